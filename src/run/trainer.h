#pragma once
// One run: rollout, update, log, checkpoint, until the steps are done.

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <memory>

#include "algo/algorithm.h"
#include "env/env.h"
#include "rollout/vec_env.h"
#include "run/config.h"
#include "run/manifest.h"

namespace o2v {

/// What a run is made of. A run over n tasks is n equal segments of its steps: the next task
/// replaces the last one after the first update beyond each. Source: spec 6.
struct RunParts {
  std::function<std::unique_ptr<Env>(int task)> make_env;  // tasks count from 0
  std::function<std::unique_ptr<Algorithm>(const EnvSpec&)> make_algorithm;
  int tasks = 1;
  int revision = 1;  // of the method's code, for the record
};
/// The tasks and the method that a config names; `config` must outlive the parts. Throws
/// ConfigError when the tasks' sizes differ.
RunParts PartsOf(const RunConfig& config);

/// Moments at which a run can be interrupted from outside; each may be empty.
struct RunHooks {
  // Asked after each iteration and each step of an evaluation; true ends the run, resumable.
  std::function<bool()> stop;
  // The logs are flushed, the checkpoint is still the old one.
  std::function<void()> before_checkpoint;
  // The new checkpoint is written under its temporary name.
  std::function<void()> before_rename;
};

/// Trains in the folder `dir` (see FolderPath) and returns kDone or kStopped.
///
/// Refused with ConfigError before anything is changed: a folder that another process trains in,
/// that holds something else or whose config.toml differs, one of a run when `resume` is false, and
/// files of somebody else in the place of the record. With `resume` a folder that does not exist
/// yet is started, and a run that has ended, by its folder or its record, is left as it is: kDone
/// again, or DivergedError again.
///
/// A run diverges where the simulator does, or where an update leaves a statistic, a parameter or
/// the normaliser not finite. That update is neither logged nor saved: last.ckpt is the last
/// healthy one. The manifest says so, and the DivergedError goes on to the caller.
///
/// `progress` gets one line that is rewritten (`terminal`) or one every 10 s.
///
/// A finished or diverged run leaves its record beside the folder: `<dir>.csv`, the learning curve
/// and `<dir>.json`, what made it (run/record.h).
RunStatus Train(const RunConfig& config, const RunParts& parts, const std::filesystem::path& dir,
                bool resume, std::ostream& progress, bool terminal, const RunHooks& hooks = {});
/// The same with PartsOf(config).
RunStatus Train(const RunConfig& config, const std::filesystem::path& dir, bool resume,
                std::ostream& progress, bool terminal, const RunHooks& hooks = {});

}  // namespace o2v
