#pragma once
// Short runs of the real tasks and methods.

#include <string>

#include "base/check.h"
#include "base/files.h"
#include "harness/config.h"
#include "harness/trainer.h"
#include "test_folder.h"

namespace o2v {

constexpr int kRollout = 8;  // steps a worker

/// `iterations` rollouts of 8 steps a worker, one epoch of minibatches of 8, a checkpoint after
/// every second rollout.
inline RunConfig ShortRun(const std::string& task, const std::string& algorithm,
                          const std::string& fidelity, int workers, int iterations) {
  const int steps = kRollout * workers;
  RunRequest request;
  request.task = task;
  request.algorithm = algorithm;
  request.fidelity = fidelity;
  request.seed = 5;
  request.steps = steps * iterations;
  request.set = {Concat("rollout=", kRollout), "epochs=1", "minibatch=8",
                 Concat("workers=", workers), Concat("checkpoint_every=", 2 * steps)};
  return ResolveRun(request);
}

}  // namespace o2v
