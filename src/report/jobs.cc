#include "report/jobs.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <set>
#include <string_view>

#include "base/check.h"
#include "base/decimal.h"
#include "run/record.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;

/// The word as a POSIX shell reads it back. Throws ConfigError for a line break in it: a command is
/// a line.
std::string Quoted(const std::string& word) {
  if (word.find('\n') != std::string::npos) {
    throw ConfigError(
        Concat("'", word, "' contains a line break; `jobs` prints one command per line"));
  }
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./,:=+@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

/// What an ablation sets in the run, as --set takes it; nothing if it does not concern the method.
std::vector<std::string> SettingsOf(const std::vector<std::string>& ablation,
                                    const RunConfig& config) {
  const Switches other =
      SwitchesFor(config.fidelity == Fidelity::kPaper ? Fidelity::kReleased : Fidelity::kPaper);
  std::vector<std::string> settings;
  for (const std::string& change : ablation) {
    const std::string key = change.substr(0, change.find('='));
    if (!Takes(config, key)) return {};
    if (change == key) {
      const auto info = std::ranges::find(SwitchRegistry(), key, &SwitchInfo::name);
      settings.push_back(Concat(key, "=", SwitchValue(other, *info)));
    } else {
      settings.push_back(change);
    }
  }
  return settings;
}

/// Marks a run that is finished, by its record: the folder may be on another machine.
void MarkFinished(const std::vector<AddedKey>& added, Job& job) {
  try {
    if (!FindRecord(job.dir, ToToml(job.config), added)) return;
    const Record run = ReadRecord(RecordPath(job.dir, ".json"), added);
    job.finished = run.status;
    job.cpu_seconds = run.cpu_seconds;
    job.old = run.revision < FindAlgorithm(job.config.algorithm).revision;
  } catch (const Error& e) {
    job.refused = e.what();
  }
}

}  // namespace

std::vector<Job> ListJobs(const JobQuery& query) {
  std::vector<ConfigText> files;
  std::vector<std::pair<std::size_t, Experiment>> experiments;  // with the place of its file
  std::size_t most_seeds = 0;
  std::set<std::string> taken;
  for (const std::string& config : query.configs) {
    files.push_back(OpenConfig(config));
    for (Experiment& experiment : ReadExperiments(files.back())) {
      experiments.push_back({files.size() - 1, std::move(experiment)});
    }
  }
  for (auto& [file, x] : experiments) {
    if (!query.tasks.empty()) {
      std::vector<std::string> tasks;
      for (const std::string& task : query.tasks) {
        if (experiments.size() > 1 && std::ranges::count(x.tasks, task) == 0) continue;
        tasks.push_back(task);
        taken.insert(task);
      }
      x.tasks = tasks;
    }
    if (!query.algorithms.empty() && x.ablations.empty()) x.algorithms = query.algorithms;
    if (!query.algorithms.empty()) {
      std::erase_if(x.algorithms, [&](const std::string& algorithm) {
        return std::ranges::count(query.algorithms, algorithm) == 0;
      });
    }
    if (!query.fidelities.empty()) x.fidelities = query.fidelities;
    if (!query.seeds.empty()) x.seeds = query.seeds;
    most_seeds = std::max(most_seeds, x.seeds.size());
  }
  for (const std::string& task : query.tasks) {
    if (!taken.contains(task)) {
      throw ConfigError(Concat("task '", task, "' is in none of the experiments"));
    }
  }

  std::vector<Job> jobs;
  auto add = [&](std::size_t file, const std::string& name, const std::string& fidelity,
                 const std::vector<std::string>& ablation, const std::string& task,
                 const std::string& algorithm, std::uint64_t seed) {
    RunRequest request;
    request.config = files[file];
    request.fidelity = fidelity;
    request.task = task;
    request.algorithm = algorithm;
    request.seed = static_cast<std::int64_t>(seed);
    Job job;
    job.config = ResolveRun(request);
    std::string variant = fidelity, set;
    if (!ablation.empty()) {
      request.set = SettingsOf(ablation, job.config);
      if (request.set.empty()) return;
      job.config = ResolveRun(request);
      for (const std::string& setting : request.set) {
        variant += "-" + setting;
        set += " --set " + Quoted(setting);
      }
    }
    job.dir = query.results / name / variant / task / algorithm / SeedFolder(seed);
    job.command =
        Concat(Quoted(query.program), " train --config ", Quoted(query.configs[file]), " --task ",
               task, " --algo ", algorithm, " --fidelity ", fidelity, set, " --seed ", seed,
               " --steps ", job.config.steps, " --out ", Quoted(job.dir.string()), " --resume");
    MarkFinished(query.added, job);
    jobs.push_back(std::move(job));
  };
  for (std::size_t i = 0; i < most_seeds; ++i) {
    for (const auto& [file, x] : experiments) {
      if (i >= x.seeds.size()) continue;
      auto ablations = x.ablations;
      if (ablations.empty()) ablations.emplace_back();
      for (const std::string& fidelity : x.fidelities) {
        for (const auto& ablation : ablations) {
          for (const std::string& task : x.tasks) {
            for (const std::string& algorithm : x.algorithms) {
              add(file, x.name, fidelity, ablation, task, algorithm, x.seeds[i]);
            }
          }
        }
      }
    }
  }
  return jobs;
}

Progress MeasureProgress(const std::vector<Job>& jobs) {
  struct Cost {
    double seconds = 0, steps = 0;
    void Add(const Job& job) {
      seconds += job.cpu_seconds;
      steps += double(job.config.steps);
    }
  };
  Progress progress;
  std::map<std::string, Cost> of_kind, of_task;
  Cost of_all;
  const auto kind_of = [](const Job& job) {
    return Concat(job.config.task, " ", job.config.algorithm, " ", ToString(job.config.fidelity));
  };
  std::set<std::string> kinds;
  for (const Job& job : jobs) {
    kinds.insert(kind_of(job));
    ++progress.runs;
    progress.refused += !job.refused.empty();
    if (!job.finished) continue;
    ++progress.finished;
    progress.old += job.old;
    if (*job.finished == RunStatus::kDiverged) {  // broke off: its cost says nothing
      ++progress.diverged;
      continue;
    }
    of_kind[kind_of(job)].Add(job);
    of_task[job.config.task].Add(job);
    of_all.Add(job);
  }
  progress.kinds = static_cast<int>(kinds.size());
  progress.timed = static_cast<int>(of_kind.size());
  if (of_all.steps == 0) return progress;
  double left = 0;
  for (const Job& job : jobs) {
    if (job.finished || !job.refused.empty()) continue;
    const auto kind = of_kind.find(kind_of(job));
    const auto task = of_task.find(job.config.task);
    const Cost& cost = kind != of_kind.end()   ? kind->second
                       : task != of_task.end() ? task->second
                                               : of_all;
    left += cost.seconds / cost.steps * double(job.config.steps);
  }
  progress.cpu_seconds_left = left;
  return progress;
}

std::string ToString(const Progress& progress, int at_once) {
  std::string text = Concat(progress.runs, " runs: ", progress.finished, " done");
  if (progress.diverged > 0) text += Concat(" (", progress.diverged, " diverged)");
  if (progress.old > 0) text += Concat(" (", progress.old, " by older revisions of their methods)");
  if (progress.refused > 0) text += Concat(", ", progress.refused, " with a refused record");
  const int left = progress.runs - progress.finished - progress.refused;
  text += Concat(", ", left, " left");
  if (left == 0) return text;
  if (!progress.cpu_seconds_left) return text + ", the time left is known after the first run";
  constexpr double kHour = 3600;
  const double hours = *progress.cpu_seconds_left / kHour;
  std::array<char, 160> line{};
  std::snprintf(line.data(), line.size(), ", about %.1f CPU hours, %.1f h with %d at a time", hours,
                hours / at_once, at_once);
  text += line.data();
  if (progress.timed < progress.kinds) {
    text += Concat(" (", progress.timed, " of ", progress.kinds,
                   " kinds of runs measured, the rest estimated from these)");
  }
  return text;
}

std::vector<std::uint64_t> ParseSeeds(const std::string& text) {
  constexpr std::uint64_t kMost = 10'000;  // seeds in one range, against a slip of the finger
  std::vector<std::uint64_t> seeds;
  const auto number = [&](std::string_view digits) {
    const auto x = ReadWhole(digits);
    if (!x || *x < 0) {
      throw ConfigError(Concat("seeds '", text, "': expected a list such as 0-4,7"));
    }
    return static_cast<std::uint64_t>(*x);
  };
  const std::string_view list = text;
  for (std::size_t begin = 0, end; begin <= list.size(); begin = end + 1) {
    end = std::min(list.find(',', begin), list.size());
    const std::string_view range = list.substr(begin, end - begin);
    const std::size_t dash = range.find('-');
    const std::uint64_t first = number(range.substr(0, dash));
    const std::uint64_t last =
        dash == std::string_view::npos ? first : number(range.substr(dash + 1));
    if (last < first || last - first >= kMost) {
      throw ConfigError(Concat("seeds '", text, "': bad range ", first, "-", last));
    }
    for (std::uint64_t seed = first; seed <= last; ++seed) seeds.push_back(seed);
  }
  return seeds;
}

}  // namespace o2v
