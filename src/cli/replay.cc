// replay: a recorded trajectory beside our simulation.

#include <iostream>
#include <memory>
#include <string>

#include "base/decimal.h"
#include "cli/commands.h"
#include "cli/options.h"
#include "report/replay.h"

namespace o2v {

void AddReplay(CLI::App& app, int& exit_code) {
  struct Options {
    std::string task, trajectory, out;
    double tolerance = 1e-9;  // spec E.6
  };
  auto opt = std::make_shared<Options>();
  CLI::App* replay =
      app.add_subcommand("replay", "compare a recorded trajectory with our simulation");
  replay->add_option("--task", opt->task, "task id")->required();
  replay
      ->add_option("--trajectory", opt->trajectory,
                   "CSV: step, ctrl0.., qpos0.., qvel0..; optionally reward, terminated, obs0..,\n"
                   "target0..")
      ->required();
  replay->add_option("--out", opt->out, "our trajectory, with the same columns");
  AddReal(*replay, "--tolerance", opt->tolerance, 0, "non-negative",
          "largest allowed |a - b| / max(1, |b|)")
      ->default_str(Decimal(opt->tolerance));
  replay->footer(
      "A row with step 0 sets the state. The exit code is 1 on FAIL.\n"
      "Example:\n  option2vec replay --task Hopper-v2 --trajectory hopper.csv --out ours.csv");
  replay->callback([opt, &exit_code] {
    const Deviation worst = ReplayFile(opt->task, opt->trajectory, opt->out);
    const bool pass = worst.value <= opt->tolerance;
    std::cout << (pass ? "PASS" : "FAIL") << ": largest deviation " << worst.value;
    if (!worst.column.empty()) {
      std::cout << " in column " << worst.column << ", row " << worst.row;
    }
    std::cout << " (tolerance " << opt->tolerance << ")\n";
    if (!pass) exit_code = 1;
  });
}

}  // namespace o2v
