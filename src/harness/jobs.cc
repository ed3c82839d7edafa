#include "harness/jobs.h"

#include <charconv>
#include <cstdio>
#include <string_view>

#include "base/check.h"
#include "base/files.h"
#include "harness/record.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;

/// The word as a POSIX shell reads it back.
std::string Quoted(const std::string& word) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./,:=+@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

std::string SeedFolder(std::uint64_t seed) {
  const std::string digits = std::to_string(seed);
  constexpr std::size_t kDigits = 3;
  return "seed-" + std::string(kDigits - std::min(kDigits, digits.size()), '0') + digits;
}

/// Marks a run that is finished, by its record: the folder may be on another machine.
void MarkFinished(Job& job) {
  const fs::path record = RecordPath(job.dir, ".json");
  if (!fs::exists(record)) return;
  const Record run = ReadRecord(record);
  if (run.config != ToToml(job.config)) {
    throw ConfigError(Concat(record.string(), ": this run was finished with another ",
                             "configuration; move it away to run it again"));
  }
  job.finished = run.status;
  job.old = run.revision < FindAlgorithm(job.config.algorithm).revision;
}

}  // namespace

std::vector<Job> ListJobs(const JobQuery& query) {
  std::vector<ConfigText> files;
  std::vector<Experiment> experiments;
  std::size_t most_seeds = 0;
  for (const std::string& config : query.configs) {
    files.push_back(OpenConfig(config));
    Experiment experiment = ReadExperiment(files.back());
    if (!query.tasks.empty()) experiment.tasks = query.tasks;
    if (!query.algorithms.empty()) experiment.algorithms = query.algorithms;
    if (!query.fidelities.empty()) experiment.fidelities = query.fidelities;
    if (!query.seeds.empty()) experiment.seeds = query.seeds;
    most_seeds = std::max(most_seeds, experiment.seeds.size());
    experiments.push_back(std::move(experiment));
  }

  std::vector<Job> jobs;
  auto add = [&](std::size_t e, const std::string& fidelity, const std::string& task,
                 const std::string& algorithm, std::uint64_t seed) {
    RunRequest request;
    request.config = files[e];
    request.fidelity = fidelity;
    request.task = task;
    request.algorithm = algorithm;
    request.seed = static_cast<std::int64_t>(seed);
    Job job;
    job.config = ResolveRun(request);
    job.dir = query.results / experiments[e].name / fidelity / task / algorithm / SeedFolder(seed);
    job.command =
        Concat(Quoted(query.program), " train --config ", Quoted(query.configs[e]), " --task ",
               task, " --algo ", algorithm, " --fidelity ", fidelity, " --seed ", seed, " --steps ",
               job.config.steps, " --out ", Quoted(job.dir.string()), " --resume");
    MarkFinished(job);
    jobs.push_back(std::move(job));
  };
  for (std::size_t i = 0; i < most_seeds; ++i) {
    for (std::size_t e = 0; e < experiments.size(); ++e) {
      const Experiment& x = experiments[e];
      if (i >= x.seeds.size()) continue;
      for (const std::string& fidelity : x.fidelities) {
        for (const std::string& task : x.tasks) {
          for (const std::string& algorithm : x.algorithms) {
            add(e, fidelity, task, algorithm, x.seeds[i]);
          }
        }
      }
    }
  }
  return jobs;
}

std::vector<std::uint64_t> ParseSeeds(const std::string& text) {
  constexpr std::uint64_t kMost = 10'000;  // seeds in one range, against a slip of the finger
  std::vector<std::uint64_t> seeds;
  const char* at = text.data();
  const char* const end = at + text.size();
  auto number = [&] {
    std::uint64_t x = 0;
    const auto [stop, error] = std::from_chars(at, end, x);
    if (error != std::errc() || x > INT64_MAX) {
      throw ConfigError(Concat("seeds '", text, "': expected a list such as 0-4,7"));
    }
    at = stop;
    return x;
  };
  auto skip = [&](char c) { return at != end && *at == c && ++at; };
  do {
    const std::uint64_t first = number(), last = skip('-') ? number() : first;
    if (last < first || last - first >= kMost) {
      throw ConfigError(Concat("seeds '", text, "': bad range ", first, "-", last));
    }
    for (std::uint64_t seed = first; seed <= last; ++seed) seeds.push_back(seed);
  } while (skip(','));
  if (at != end) throw ConfigError(Concat("seeds '", text, "': expected a list such as 0-4,7"));
  return seeds;
}

}  // namespace o2v
