// Every method improves, on a toy task and on a real one.

#include <gtest/gtest.h>

#include "algo/setup.h"
#include "report/stats.h"

namespace o2v {
namespace {

/// Mean return of episodes `from`, ..., `from` + n - 1.
double MeanReturn(const std::vector<Episode>& episodes, std::size_t from, std::size_t n) {
  std::vector<double> returns;
  for (std::size_t i = from; i < from + n; ++i) returns.push_back(episodes.at(i).ret);
  return Mean(returns);
}

/// Small networks that learn fast. OC and IOPG, which take one step a rollout, get more steps.
struct Budget {
  std::vector<std::string> set;
  int steps;
};
Budget BudgetOf(const std::string& method) {
  if (HasRatio(method)) {
    return {
        {"hidden=32", "workers=2", "rollout=256", "minibatch=64", "epochs=5", "learning_rate=1e-3"},
        20480};
  }
  return {{"hidden=32", "workers=4", "rollout=5", "learning_rate=3e-3"}, 40960};
}

/// What training left behind.
struct Trained {
  std::vector<Episode> episodes;
  std::vector<std::vector<double>> updates;  // the statistics of each

  Trained(Algorithm& algorithm, VecEnv& env, int steps) {
    while (env.TotalSteps() < steps) {
      algorithm.Collect(env, episodes);
      std::vector<double>& stats = updates.emplace_back();
      for (const SumAndCount& ratio : algorithm.Update()) stats.push_back(ratio.Value());
    }
  }
  double First() const { return MeanReturn(episodes, 0, 20); }
  double Last() const { return MeanReturn(episodes, episodes.size() - 50, 50); }
};

class Learning : public testing::TestWithParam<std::string> {};

TEST_P(Learning, KeepsAPointNearZero) {
  // An untrained policy pushes at random: |x| is about 0.5, so an episode of 50 steps costs about
  // 25. A trained one is at 0 within ten steps and stays within its noise: over 60 seeds Option2Vec
  // cost 1.5 to 1.9 in `paper`, 2.0 to 7.6 with a median of 2.4 in `released`. One run may lie in
  // that tail, the mean of three hardly does.
  constexpr int kSeeds = 3;
  for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
    const Budget budget = BudgetOf(GetParam());
    RunConfig config = SmallConfig(GetParam(), fidelity, budget.set);
    double last = 0;
    for (config.seed = 1; config.seed <= kSeeds; ++config.seed) {
      SCOPED_TRACE(ToString(fidelity) + ", seed " + std::to_string(config.seed));
      VecEnv env = PointTask(config.workers, /*time_limit=*/50);
      const auto algorithm = MakeRunAlgorithm(config, env.Spec());
      const Trained trained(*algorithm, env, budget.steps);
      EXPECT_LT(trained.First(), -15);
      EXPECT_GT(trained.Last(), -10);
      for (const std::string& stage : algorithm->StageNames()) {
        const std::string name = "value_loss_" + stage;
        EXPECT_LT(Stat(*algorithm, trained.updates.back(), name),
                  0.5 * Stat(*algorithm, trained.updates.front(), name))
            << stage;
      }
      last += trained.Last() / kSeeds;
    }
    EXPECT_GT(last, -5) << ToString(fidelity);
  }
}

TEST_P(Learning, BalancesAPole) {
  // InvertedPendulum-v2 gives 1 a step until the pole falls, after about 9 steps at first; over
  // seeds 1 to 6 the last 50 episodes were 45 to 400 steps long.
  const Budget budget = BudgetOf(GetParam());
  const RunConfig config =
      ConfigFor("InvertedPendulum-v2", GetParam(), Fidelity::kPaper, budget.set);
  VecEnv env([&] { return MakeEnv(config.task, {}); }, config.workers, config.seed);
  env.Reset();
  const auto algorithm = MakeRunAlgorithm(config, env.Spec());
  const Trained trained(*algorithm, env, budget.steps);
  EXPECT_LT(trained.First(), 15);
  EXPECT_GT(trained.Last(), 40);
}

INSTANTIATE_TEST_SUITE_P(Methods, Learning, testing::ValuesIn(MethodIds()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace o2v
