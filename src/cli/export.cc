// export: a run or its policy for other programs.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "base/files.h"
#include "cli/commands.h"
#include "cli/options.h"
#include "cli/policy_file.h"
#include "report/tensorboard.h"
#include "run/checkpoint.h"
#include "run/record.h"

namespace o2v {

void AddExport(CLI::App& app) {
  struct Options : RunOptions {
    std::optional<std::string> policy, tensorboard;
    std::filesystem::path out;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("export", "a run or its policy for other programs");
  CLI::App* what = command->add_option_group("what")->require_option(1);
  what->add_option("--policy", opt->policy,
                   "folder of a run, or a checkpoint: parameters and normaliser alone into --out");
  what->add_option("--tensorboard", opt->tensorboard,
                   "folder of a run: its curves as an event file in the folder --out");
  opt->Add(*command);
  command->add_option("--out", opt->out, "file of the policy; folder of the event file")
      ->required();
  command->footer(
      "Task, method, fidelity and --set are for policies whose file does not say them.\n"
      "Examples:\n"
      "  option2vec export --policy runs/a --out a.safetensors\n"
      "  option2vec export --tensorboard runs/a --out tensorboard/a");
  command->callback([opt] {
    if (opt->policy) {
      RequireWritable(opt->out);
      const std::filesystem::path file = FindCheckpoint(*opt->policy);
      LoadedPolicy policy = LoadPolicyFile(file.string(), opt->request);
      Metadata metadata = ReadMetadata(file);
      if (metadata.empty()) metadata = {{"config", ToToml(policy.config)}};
      SavePolicy(opt->out, metadata, *policy.algorithm, policy.normalizer);
    } else {
      const std::string events = EventFile(FolderPath(*opt->tensorboard));
      std::filesystem::create_directories(opt->out);
      WriteFileAtomically(opt->out / "events.out.tfevents.option2vec", events);
    }
  });
}

}  // namespace o2v
