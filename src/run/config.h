#pragma once
// What a run is made from: TOML files, their layers, and the resolved result.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "algo/algorithm.h"
#include "algo/switches.h"
#include "base/settings.h"
#include "env/env.h"

namespace o2v {

/// A fully resolved run.
struct RunConfig {
  std::string task, algorithm;  // registry ids; several tasks joined by commas
  Fidelity fidelity = Fidelity::kPaper;
  std::uint64_t seed = 0;             // at most 2^63 - 1
  std::int64_t steps = 0;             // [environment steps] of all workers
  int workers = 0;                    // N
  std::int64_t checkpoint_every = 0;  // [environment steps]
  std::int64_t eval_every = 0;        // [environment steps], 0 = off
  int eval_episodes = 0;              // each time
  Switches switches;
  Settings hyper;  // the method's numbers, keys of paper_configs/algo/<algorithm>.toml
};

/// A config file, read.
struct ConfigText {
  std::string name;  // for messages
  std::string text;
};

/// `config` is a path that ends in ".toml", or the name of a file compiled into the program:
/// "quick" is paper_configs/quick.toml. Throws ConfigError.
ConfigText OpenConfig(const std::string& config);

/// What the command line says about a run; what it leaves out comes from the files.
struct RunRequest {
  std::optional<std::string> task, algorithm, fidelity;
  std::optional<std::int64_t> seed, steps;
  std::optional<ConfigText> config;
  std::vector<std::string> set;  // "key=value": a method's number, a switch, or a number of [run]
};

/// A key that was added after runs had been kept. A resolved configuration of an older format,
/// which lacks it, means the run with `value`: what every such run did.
struct AddedKey {
  std::string section;  // "run", "switches" or a method's id
  std::string key;
  std::string value;  // as --set takes it
  int since;          // first format of configurations that has the key; those of 1 say no format
};
/// All of them. A new switch, or a new number of a method, takes one row.
const std::vector<AddedKey>& AddedKeys();

/// The experiment of this name that is compiled into the program: quick, single_task, ...
std::optional<ConfigText> FindSuite(const std::string& name);

/// Whether the run's method reads the switch; those of transfer only in a run over several tasks.
bool Concerns(const SwitchInfo& info, const RunConfig& config);
/// Whether the key is a switch that concerns the run, or a number of its method.
bool Takes(const RunConfig& config, const std::string& key);

/// Layers, later ones win: run.toml, algo/<method>.toml, `config`, the request, its `set`. Throws
/// ConfigError naming file, line and key for an unknown, missing or mistyped key.
RunConfig ResolveRun(const RunRequest& request, const std::vector<AddedKey>& added = AddedKeys());

/// The run as TOML that `config` and ParseRunConfig read back to the same run, bit for bit.
std::string ToToml(const RunConfig& config, const std::vector<AddedKey>& added = AddedKeys());

/// Reads what ToToml wrote, also in an older format; every other key must be there. `file_name` is
/// for messages. Throws ConfigError.
RunConfig ParseRunConfig(const std::string& text, const std::string& file_name,
                         const std::vector<AddedKey>& added = AddedKeys());

/// The run's method on a task of these sizes. Throws ConfigError when a number was not read by it.
/// `draw_weights` false: its weights stay zero, to be counted.
std::unique_ptr<Algorithm> MakeRunAlgorithm(const RunConfig& config, const EnvSpec& spec,
                                            bool draw_weights = true);

/// Lists of an experiment file; runs are their product.
struct Experiment {
  std::string name;  // the file's, without folder and ".toml"
  std::vector<std::string> tasks, algorithms, fidelities;
  std::vector<std::uint64_t> seeds;
  // What is changed in a run, all at once: switches to turn to the other fidelity's setting, and
  // settings "key=value". A run has one of these; none: the fidelities as they are.
  std::vector<std::vector<std::string>> ablations;
};

/// Reads the section [experiment], or all of several [[experiment]]. Throws ConfigError.
std::vector<Experiment> ReadExperiments(const ConfigText& file);

}  // namespace o2v
