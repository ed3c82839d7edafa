// interpret: what each dimension of an embedding does.

#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <string>

#include "base/decimal.h"
#include "base/files.h"
#include "cli/commands.h"
#include "cli/options.h"
#include "cli/policy_file.h"
#include "report/interpret.h"
#include "run/checkpoint.h"
#include "run/record.h"

namespace o2v {

void AddInterpret(CLI::App& app) {
  struct Options : RunOptions {
    std::filesystem::path run, out;
    int episodes = 10;
    double delta = kDelta;
    std::uint64_t seed = 0;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* interpret =
      app.add_subcommand("interpret", "measure what each dimension of Option2Vec's embedding does");
  interpret->add_option("run", opt->run, "folder of a run, or a checkpoint file")->required();
  opt->Add(*interpret);
  AddWhole(*interpret, "--episodes", opt->episodes, 1, kMaxInt, "number of whole episodes")
      ->default_str("10");
  AddReal(*interpret, "--delta", opt->delta, std::numeric_limits<double>::min(), "positive",
          "change of a dimension")
      ->default_str(Decimal(kDelta));
  AddWhole(*interpret, "--seed", opt->seed, 0, kMaxWhole, "seed of the episodes")->default_str("0");
  interpret->add_option(
      "--out", opt->out,
      "CSV (default results/interpret/<fidelity>/<task>/option2vec/seed-NNN.csv);\n"
      "a .json file beside it says how it was made. Existing files are replaced only\n"
      "if `interpret` wrote them");
  interpret->footer(
      "Writes one row per dimension d: W_o(d, k); the mean of d mu_a / d o_hat_d over visited "
      "states;\n"
      "the mean change of mu_a when o_hat_d grows by delta. o_hat is the executed option's "
      "embedding.\n"
      "After a transfer run, --task chooses one of its tasks (default: the last one). The "
      "networks\n"
      "are those at the end of the run.\n"
      "Example:\n  option2vec interpret runs/a --episodes 20 --out a.csv");
  interpret->callback([opt] {
    const std::filesystem::path file = FindCheckpoint(opt->run);
    LoadedPolicy policy = LoadPolicyFile(file.string(), opt->request);
    if (!policy.algorithm->Embedding()) {
      throw ConfigError(Concat(file.string(), ": trained by ", policy.config.algorithm,
                               ", whose options have no embedding"));
    }
    const Metadata metadata = ReadMetadata(file);
    if (opt->out.empty() && !metadata.contains("config")) {
      throw ConfigError(file.string() + ": does not name its run; give --out");
    }
    const std::string& task = policy.env->Spec().id;
    const std::filesystem::path out =
        opt->out.empty() ? InterpretationPath(policy.config, task) : opt->out;
    if (out.has_parent_path()) std::filesystem::create_directories(out.parent_path());
    RequireInterpretationPlace(out);
    const Interpretation found = Interpret(*policy.algorithm, policy.normalizer, *policy.env,
                                           opt->episodes, opt->delta, opt->seed);
    if (const auto json = BesideInterpretation(out)) {
      WriteFileAtomically(*json,
                          InterpretationJson(found, metadata, task, opt->episodes, opt->seed));
    }
    WriteFileAtomically(out, InterpretationCsv(found));
    std::cout << out.string() << ": " << found.W_o.rows() << " dimensions, " << found.states
              << " states of " << opt->episodes << " episodes on " << task << "\n";
  });
}

}  // namespace o2v
