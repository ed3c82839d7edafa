#pragma once
// Small methods, as a run makes them.

#include <memory>
#include <string>
#include <vector>

#include "algo/toy.h"
#include "run/config.h"

namespace o2v {

/// `set` ("key=value") without the numbers of rollouts that a method does not have: OC makes one
/// step on a whole rollout, IOPG on an episode.
inline std::vector<std::string> ForMethod(const std::string& method, std::vector<std::string> set) {
  const bool iopg = method == "iopg", one_step = iopg || method == "oc";
  std::erase_if(set, [&](const std::string& s) {
    return (iopg && s.starts_with("rollout=")) ||
           (one_step && (s.starts_with("minibatch=") || s.starts_with("epochs=")));
  });
  return set;
}

/// Methods that compare probabilities of an update with those of the rollout.
inline bool HasRatio(const std::string& method) { return method != "oc" && method != "iopg"; }

/// All methods, as parameters of tests.
inline std::vector<std::string> MethodIds() {
  std::vector<std::string> ids;
  for (const AlgorithmEntry& method : AlgorithmRegistry()) ids.push_back(method.id);
  return ids;
}

/// A method's own numbers for a task, one step of training, and then `set`.
inline RunConfig ConfigFor(const std::string& task, const std::string& method, Fidelity fidelity,
                           const std::vector<std::string>& set) {
  RunRequest request;
  request.task = task;
  request.algorithm = method;
  request.fidelity = ToString(fidelity);
  request.seed = 1;
  request.steps = 1;
  request.set = ForMethod(method, set);
  return ResolveRun(request);
}

/// The same for small networks and short rollouts, and then `set`.
inline RunConfig SmallConfig(const std::string& method, Fidelity fidelity,
                             const std::vector<std::string>& set = {}) {
  std::vector<std::string> all = {"workers=2", "hidden=8", "rollout=12", "minibatch=8", "epochs=2"};
  if (method == "option2vec") {
    all.insert(all.end(), {"embedding=6", "ffn=7", "init_hidden=16"});
  }
  if (method == "dac_onestep") all.push_back("ynet_hidden=16");
  if (method == "oc") all.push_back("target_every=7");
  all.insert(all.end(), set.begin(), set.end());
  return ConfigFor(EnvRegistry().front().id, method, fidelity, all);
}

}  // namespace o2v
