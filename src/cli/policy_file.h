#pragma once
// Trained policies, as commands are given them.

#include <memory>
#include <string>

#include "algo/algorithm.h"
#include "env/env.h"
#include "rollout/normalizer.h"
#include "run/config.h"

namespace o2v {

/// A checkpoint's policy on its task.
struct LoadedPolicy {
  RunConfig config;
  std::unique_ptr<Env> env;
  std::unique_ptr<Algorithm> algorithm;
  Normalizer normalizer;
};

/// `request` completes, or repeats, what the file says of itself.
LoadedPolicy LoadPolicyFile(const std::string& checkpoint, RunRequest request);

}  // namespace o2v
