#pragma once
// The runs of an experiment, as commands.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/config.h"
#include "harness/manifest.h"

namespace o2v {

/// What to list. A list that is not empty replaces the experiment's own.
struct JobQuery {
  std::string program = "option2vec";  // first word of the commands
  std::vector<std::string> configs;    // experiments, see OpenConfig
  std::filesystem::path results = "results";
  std::vector<std::string> tasks, algorithms, fidelities;
  std::vector<std::uint64_t> seeds;
};

/// One run.
struct Job {
  RunConfig config;
  std::filesystem::path dir;  // <results>/<experiment>/<fidelity>/<task>/<algorithm>/seed-003
  std::string command;        // for a shell: starts the run, or goes on with an unfinished one
  std::optional<RunStatus> finished;  // done or diverged: nothing is left to do
  bool old = false;                   // finished by an older revision of the method's code
};

/// The product of each experiment's lists, seeds outermost over all experiments, so that whatever
/// has finished is a balanced comparison. All configs are resolved here. Throws ConfigError for a
/// bad config, and for a run that was finished with another one.
std::vector<Job> ListJobs(const JobQuery& query);

/// "0-2,7" -> 0, 1, 2, 7. Throws ConfigError.
std::vector<std::uint64_t> ParseSeeds(const std::string& text);

}  // namespace o2v
