// Every method improves on a toy task.

#include <gtest/gtest.h>

#include "algo/setup.h"
#include "base/stats.h"

namespace o2v {
namespace {

constexpr int kSteps = 50;  // of an episode

/// Mean return of episodes `from`, ..., `from` + n - 1.
double MeanReturn(const std::vector<Episode>& episodes, std::size_t from, std::size_t n) {
  std::vector<double> returns;
  for (std::size_t i = from; i < from + n; ++i) returns.push_back(episodes.at(i).ret);
  return Mean(returns);
}

TEST(Learning, KeepsAPointNearZero) {
  // An untrained policy pushes at random: |x| is about 0.5 at the start and grows, so an episode
  // costs about 30. A trained one is at 0 within ten steps and keeps within its noise.
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
      const RunConfig config = SmallConfig(
          method.id, fidelity,
          {"hidden=32", "rollout=256", "minibatch=64", "epochs=5", "learning_rate=2e-3"});
      VecEnv env = PointTask(config.workers, kSteps);
      const auto algorithm = MakeRunAlgorithm(config, env.Spec());
      std::vector<Episode> episodes;
      std::vector<double> stats;
      for (int iteration = 0; iteration < 40; ++iteration) {
        algorithm->Collect(env, episodes);
        algorithm->Update(stats);
      }
      const double before = MeanReturn(episodes, 0, 20);
      const double after = MeanReturn(episodes, episodes.size() - 50, 50);
      RecordProperty(method.id + "_" + ToString(fidelity), std::to_string(after));
      EXPECT_LT(before, -20) << method.id << ", " << ToString(fidelity);
      EXPECT_GT(after, -10) << method.id << ", " << ToString(fidelity);
    }
  }
}

}  // namespace
}  // namespace o2v
