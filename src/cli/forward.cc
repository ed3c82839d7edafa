// forward: outputs of the networks at given inputs.

#include <memory>
#include <string>

#include "cli/commands.h"
#include "cli/options.h"
#include "cli/policy_file.h"
#include "run/evaluate.h"

namespace o2v {

void AddForward(CLI::App& app) {
  struct Options : RunOptions {
    std::string checkpoint, input, output;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* forward =
      app.add_subcommand("forward", "compute the networks' outputs at given inputs");
  forward
      ->add_option("--checkpoint", opt->checkpoint,
                   "last.ckpt of a run, or a safetensors file from elsewhere")
      ->required();
  opt->Add(*forward);
  forward->add_option("--input", opt->input, "CSV: s0.. (normalised state), o_prev, init, o")
      ->required();
  forward->add_option("--out", opt->output, "CSV: P0.., mu0.., sigma0.., q0..")->required();
  forward->footer(
      "Options count from 0. Action net and critic get option o. Dropout is off.\n"
      "Example:\n"
      "  option2vec forward --checkpoint runs/a/last.ckpt --input states.csv --out outputs.csv");
  forward->callback([opt] {
    LoadedPolicy policy = LoadPolicyFile(opt->checkpoint, opt->request);
    Forward(*policy.algorithm, policy.env->Spec(), opt->input, opt->output);
  });
}

}  // namespace o2v
