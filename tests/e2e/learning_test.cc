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
  // An untrained policy pushes at random: |x| is about 0.5, so an episode costs about 20. A trained
  // one is at 0 within ten steps and stays within its noise: over seeds 1 to 6 it cost 1.5 to 4.5.
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
      const std::string what = method.id + ", " + ToString(fidelity);
      const RunConfig config = SmallConfig(
          method.id, fidelity,
          {"hidden=32", "rollout=256", "minibatch=64", "epochs=5", "learning_rate=1e-3"});
      VecEnv env = PointTask(config.workers, kSteps);
      const auto algorithm = MakeRunAlgorithm(config, env.Spec());
      std::vector<Episode> episodes;
      std::vector<double> first, last;
      algorithm->Collect(env, episodes);
      algorithm->Update(first);
      for (int iteration = 1; iteration < 40; ++iteration) {
        algorithm->Collect(env, episodes);
        algorithm->Update(last);
      }
      EXPECT_LT(MeanReturn(episodes, 0, 20), -15) << what;
      EXPECT_GT(MeanReturn(episodes, episodes.size() - 50, 50), -7) << what;
      for (const std::string& stage : algorithm->Stages()) {
        const std::string name = "value_loss_" + stage;
        EXPECT_LT(Stat(*algorithm, last, name), 0.5 * Stat(*algorithm, first, name))
            << what << ", " << stage;
      }
    }
  }
}

}  // namespace
}  // namespace o2v
