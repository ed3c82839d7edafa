// eval: returns of a trained policy.

#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/csv.h"
#include "base/files.h"
#include "cli/commands.h"
#include "cli/options.h"
#include "cli/policy_file.h"
#include "report/stats.h"
#include "run/evaluate.h"

namespace o2v {

void AddEval(CLI::App& app) {
  struct Options : RunOptions {
    std::string checkpoint, action = "sample";
    std::optional<std::string> trajectory;
    int episodes = 10;
    std::uint64_t seed = 0;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* eval =
      app.add_subcommand("eval", "run episodes with a trained policy and print their returns");
  eval->add_option("--checkpoint", opt->checkpoint,
                   "last.ckpt of a run, or a safetensors file from elsewhere")
      ->required();
  opt->Add(*eval);
  AddWhole(*eval, "--episodes", opt->episodes, 1, kMaxInt, "number of whole episodes")
      ->default_str("10");
  eval->add_option("--action", opt->action, "sample the Gaussian, or take its mean")
      ->check(CLI::IsMember({"sample", "mean"}))
      ->capture_default_str();
  AddWhole(*eval, "--seed", opt->seed, 0, kMaxWhole, "seed of the episodes")->default_str("0");
  eval->add_option("--trajectory", opt->trajectory,
                   "CSV of all steps: episode, step, o, P0.., a0.., reward, obs0..");
  eval->footer(
      "--task, --algo, --fidelity and --set are needed only when the file does not name them.\n"
      "After a transfer run, --task chooses one of its tasks (default: the last one).\n"
      "Options are always sampled.\n"
      "Examples:\n"
      "  option2vec eval --checkpoint runs/a/last.ckpt --task HalfCheetah-v2 --action mean\n"
      "  option2vec eval --checkpoint foreign.safetensors --task Hopper-v2 --algo ppo "
      "--fidelity released");
  eval->callback([opt] {
    LoadedPolicy policy = LoadPolicyFile(opt->checkpoint, opt->request);
    CsvTable trajectory = NewTrajectory(policy.env->Spec(), policy.algorithm->NumOptions());
    StepHook visit;
    if (opt->trajectory) {
      RequireWritable(*opt->trajectory);
      visit = [&trajectory](const EvalStep& step) { Append(step, trajectory); };
    }
    const auto episodes = Evaluate(*policy.algorithm, policy.normalizer, *policy.env, opt->episodes,
                                   opt->action == "sample", opt->seed, visit);
    if (opt->trajectory) WriteFileAtomically(*opt->trajectory, CsvText(trajectory));
    std::vector<double> returns;
    std::cout << "episode,return,length\n";
    for (const EvalEpisode& episode : episodes) {
      std::cout << returns.size() << "," << episode.ret << "," << episode.length << "\n";
      returns.push_back(episode.ret);
    }
    std::cout << "# mean " << Mean(returns) << " +- " << Std(returns) << " (std, n "
              << returns.size() << ")\n";
  });
}

}  // namespace o2v
