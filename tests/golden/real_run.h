#pragma once
// Short runs of the real tasks and methods.

#include <ostream>
#include <string>

#include "algo/setup.h"
#include "base/files.h"
#include "run/trainer.h"
#include "test_folder.h"

namespace o2v {

constexpr int kRollout = 8;  // steps a worker

/// Task, method, fidelity and workers of a run; printed as a test's name.
struct RunCase {
  std::string task, algorithm;
  Fidelity fidelity;
  int workers;

  std::string Name() const {
    std::string name = Concat(task, '_', algorithm, '_', ToString(fidelity), '_', workers);
    std::erase(name, '-');
    return name;
  }
};
inline void PrintTo(const RunCase& c, std::ostream* out) { *out << c.Name(); }

/// `iterations` rollouts of 8 steps a worker, one epoch of minibatches of 8, a checkpoint after
/// every second rollout. An iteration of IOPG is an episode, which is about as long on a task that
/// an untrained policy soon fails.
inline RunConfig ShortRun(const RunCase& c, int iterations) {
  const int steps = kRollout * c.workers;
  RunConfig config =
      ConfigFor(c.task, c.algorithm, c.fidelity,
                {Concat("rollout=", kRollout), "epochs=1", "minibatch=8",
                 Concat("workers=", c.workers), Concat("checkpoint_every=", 2 * steps)});
  // A target network that is sometimes the online one, mostly not, and never the first one for
  // long.
  if (config.hyper.Has("target_every")) config.hyper.Set("target_every", 12, "test");
  config.seed = 5;
  config.steps = steps * iterations;
  return config;
}

}  // namespace o2v
