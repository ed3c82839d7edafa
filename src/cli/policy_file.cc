#include "cli/policy_file.h"

#include <optional>
#include <utility>

#include "base/check.h"
#include "env/pairs.h"
#include "run/checkpoint.h"

namespace o2v {

LoadedPolicy LoadPolicyFile(const std::string& checkpoint, RunRequest request) {
  const Metadata metadata = ReadMetadata(checkpoint);
  if (const auto config = metadata.find("config"); config != metadata.end()) {
    const RunConfig own = ParseRunConfig(config->second, checkpoint);
    auto agree = [&](const std::optional<std::string>& given, const std::string& is) {
      if (given && *given != is) {
        throw ConfigError(Concat(checkpoint, ": trained with '", is, "', not '", *given, "'"));
      }
    };
    agree(request.algorithm, own.algorithm);
    agree(request.fidelity, ToString(own.fidelity));
    request.config = ConfigText{checkpoint, config->second};
  }
  const std::optional<std::string> task = request.task;
  if (request.config) request.task.reset();  // the file's own; --task says where to act
  const RunConfig config = ResolveRun(request);
  const EnvOptions options{.contact_forces = config.switches.contact_forces};
  std::unique_ptr<Env> env = MakeEnv(SplitTasks(task.value_or(config.task)).back(), options);
  const EnvSpec spec = env->Spec();
  if (task && request.config) {
    const EnvSpec own = MakeEnv(SplitTasks(config.task).back(), options)->Spec();
    if (spec.S != own.S || spec.A != own.A) {
      throw ConfigError(Concat(checkpoint, ": trained on ", own.id, ", which has ", own.S,
                               " observations and ", own.A, " actions; ", spec.id, " has ", spec.S,
                               " and ", spec.A));
    }
  }
  LoadedPolicy policy{config, std::move(env), MakeRunAlgorithm(config, spec), Normalizer(spec.S)};
  LoadPolicy(checkpoint, *policy.algorithm, policy.normalizer);
  return policy;
}

}  // namespace o2v
