// train: one run into one folder.

#include <unistd.h>
#include <iostream>
#include <memory>
#include <string>

#include "base/check.h"
#include "cli/commands.h"
#include "cli/options.h"
#include "run/config.h"
#include "run/trainer.h"

namespace o2v {

void AddTrain(CLI::App& app) {
  struct Options : RunOptions {
    std::string out;
    bool resume = false;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* train = app.add_subcommand("train", "train one run into one folder");
  opt->Add(*train);
  AddWhole(*train, "--seed", opt->request.seed, 0, kMaxWhole,
           "seed of all random streams (default 0)");
  AddWhole(*train, "--steps", opt->request.steps, 1, kMaxWhole,
           "environment steps, summed over workers");
  train->add_option("--out", opt->out, "folder of the run")->required();
  train->add_option("--config", opt->config,
                    "a .toml file, or the name of a built-in one; the other options win over it");
  train->add_flag("--resume", opt->resume, "continue an unfinished run, or start a new one");
  train->footer(
      "Examples:\n"
      "  option2vec train --task HalfCheetah-v2 --algo option2vec --seed 1 --out runs/a\n"
      "  option2vec train --task Hopper-v2 --algo ppo --fidelity released --set hidden=64 "
      "--steps 200000 --out runs/b\n"
      "  option2vec train --config runs/a/config.toml --out runs/a --resume");
  train->callback([opt] {
    if (opt->config) opt->request.config = OpenConfig(*opt->config);
    const RunConfig config = ResolveRun(opt->request);
    NoteSignals();
    RunHooks hooks;
    hooks.stop = Signalled;
    const bool terminal = ::isatty(STDERR_FILENO) == 1;
    if (Train(config, opt->out, opt->resume, std::cerr, terminal, hooks) == RunStatus::kStopped) {
      throw Error(opt->out + ": stopped by a signal; use --resume to continue");
    }
  });
}

}  // namespace o2v
