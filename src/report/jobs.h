#pragma once
// The runs of an experiment, as commands.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "run/config.h"
#include "run/manifest.h"

namespace o2v {

/// What to list. A list that is not empty replaces the experiments' own. But several experiments
/// take only `tasks`, and those with ablations only `algorithms`, that they have themselves.
struct JobQuery {
  std::string program = "option2vec";  // first word of the commands
  std::vector<std::string> configs;    // experiments, see OpenConfig
  std::filesystem::path results = "results";
  std::vector<std::string> tasks, algorithms, fidelities;
  std::vector<std::uint64_t> seeds;
  std::vector<AddedKey> added = AddedKeys();  // by which older records are read
};

/// One run.
struct Job {
  RunConfig config;
  std::filesystem::path dir;  // <results>/<experiment>/<fidelity>/<task>/<algorithm>/seed-003; of
                              // an ablation <fidelity>-<key>=<value>
  std::string command;        // for a shell: starts the run, or goes on with an unfinished one
  std::optional<RunStatus> finished;  // done or diverged: nothing is left to do
  bool old = false;                   // finished by an older revision of the method's code
  double cpu_seconds = 0;             // that a finished run took
  std::string refused;                // why its record does not count: a person must look at it,
                                      // the run is neither finished nor left
};

/// The product of each experiment's lists, seeds outermost over all experiments, so that whatever
/// has finished is a balanced comparison. All configs are resolved here. Throws ConfigError for a
/// bad config. A record that is damaged, half or of another configuration is refused alone.
std::vector<Job> ListJobs(const JobQuery& query);

/// How far a grid of runs has come.
struct Progress {
  int runs = 0, finished = 0;
  int diverged = 0, old = 0;               // of the finished ones; see Job
  int refused = 0;                         // by their records
  int kinds = 0, timed = 0;                // kinds of runs; those with a finished run
  std::optional<double> cpu_seconds_left;  // estimate; nothing when no run has finished
};
/// Runs of the same task, method and fidelity are of a kind. A run that is left is taken to cost
/// what finished runs of its kind did on average, else those of its task, else all; unfinished ones
/// count as not begun.
Progress MeasureProgress(const std::vector<Job>& jobs);
/// One line: runs done and left, CPU hours left, hours left with `at_once` runs at a time.
std::string ToString(const Progress& progress, int at_once);

/// "0-2,7" -> 0, 1, 2, 7. Throws ConfigError.
std::vector<std::uint64_t> ParseSeeds(const std::string& text);

}  // namespace o2v
