// Old and new probabilities agree while nothing has been learnt (spec 10.4). With learning rate 0
// nothing ever is, and with a clip range of 1e-5 a ratio further from 1 counts as clipped.

#include <gtest/gtest.h>

#include "algo/setup.h"

namespace o2v {
namespace {

/// Share of the samples whose ratio is not 1, by stage.
std::vector<double> Deviating(const std::string& method, Fidelity fidelity,
                              std::vector<std::string> set) {
  set.insert(set.end(), {"learning_rate=0", "ratio_clip=1e-5", "rollout=32"});
  const RunConfig config = SmallConfig(method, fidelity, set);
  VecEnv env = PointTask(config.workers, /*time_limit=*/7);
  const auto algorithm = MakeRunAlgorithm(config, env.Spec());
  const std::vector<double> stats = Iterate(*algorithm, env);
  std::vector<double> shares;
  for (const std::string& stage : algorithm->Stages()) {
    shares.push_back(Stat(*algorithm, stats, "clip_fraction_" + stage));
  }
  return shares;
}

TEST(Ratio, IsOneInThePaperSettings) {
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    for (const double share : Deviating(method.id, Fidelity::kPaper, {})) {
      EXPECT_EQ(share, 0) << method.id;
    }
  }
}

TEST(Ratio, IsOneInReleasedPpo) {
  EXPECT_EQ(Deviating("ppo", Fidelity::kReleased, {}), std::vector<double>{0});
}

TEST(Ratio, OfReleasedOption2VecDiffersByTheRedrawInTheActionStageAlone) {
  const auto shares =
      Deviating("option2vec", Fidelity::kReleased, {"o2v_dropout=0", "o2v_init_flag=paper"});
  EXPECT_EQ(shares[0], 0);
  EXPECT_GT(shares[1], 0.2);
}

TEST(Ratio, OfReleasedOption2VecDiffersWhereInitAndDoneDiffer) {
  const auto shares =
      Deviating("option2vec", Fidelity::kReleased, {"o2v_dropout=0", "o2v_option_in_update=paper"});
  // Episodes of 7 steps: first states (5 of 32 steps) and last states (4 of 32).
  EXPECT_DOUBLE_EQ(shares[0], 9.0 / 32);
  EXPECT_EQ(shares[1], 0);
}

TEST(Ratio, DiffersByTheMasksWithDropout) {
  const auto shares = Deviating("option2vec", Fidelity::kPaper, {"o2v_dropout=0.2"});
  EXPECT_GT(shares[0], 0.5);
  EXPECT_EQ(shares[1], 0);  // the action net has no dropout
}

}  // namespace
}  // namespace o2v
