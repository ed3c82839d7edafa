// Old and new probabilities agree while nothing has been learnt (spec 10.4). With learning rate 0
// nothing ever is, and with a clip range of 1e-5 a ratio further from 1 counts as clipped.

#include <gtest/gtest.h>

#include <cmath>

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
  for (const std::string& stage : algorithm->StageNames()) {
    shares.push_back(Stat(*algorithm, stats, "clip_fraction_" + stage));
  }
  return shares;
}

TEST(SumAndCount, IsOneInThePaperSettings) {
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    if (!HasRatio(method.id)) continue;
    for (const double share : Deviating(method.id, Fidelity::kPaper, {})) {
      EXPECT_EQ(share, 0) << method.id;
    }
  }
}

TEST(SumAndCount, IsOneWhereTheReleasedCodeRecomputesWhatActed) {
  for (const char* method : {"ppo", "ppoc", "dac_onestep"}) {
    for (const double share : Deviating(method, Fidelity::kReleased, {})) {
      EXPECT_EQ(share, 0) << method;
    }
  }
}

TEST(SumAndCount, OfReleasedAhpDiffersByTheTerminationOfTheWrongOption) {
  EXPECT_EQ(Deviating("ahp_ppo", Fidelity::kReleased, {"ahp_beta_index=paper"})[0], 0);
  EXPECT_GT(Deviating("ahp_ppo", Fidelity::kReleased, {})[0], 0.1);
}

/// Ratios of the high stage, row by row: with one row's advantage 1 and nothing clipped the
/// surrogate is -r / B.
Vec HighRatios(Algorithm& algorithm, Batch batch) {
  Mat P;
  algorithm.OptionPolicy(batch.s, batch.o_prev, batch.init, P);
  const Index B = batch.Size();
  for (Index b = 0; b < B; ++b) {
    batch.option.logp_old(b) = std::log(P(batch.o[std::size_t(b)], b));
  }
  Vec ratios(B);
  for (Index b = 0; b < B; ++b) {
    batch.option.adv_hat = Vec::Unit(B, b);
    ratios(b) = Real(-double(B) * algorithm.Loss(0, batch, nullptr).surrogate);
  }
  return ratios;
}

TEST(SumAndCount, OfReleasedDacIsThatOfTheLostMask) {
  // pi = 1/4, beta = 1/2 at the start: 0.625 for o = o', else 0.125. In the update rows 1, 2, ...
  // have 0.125 throughout, row 0 0.625 for every o' of the minibatch; spec 4.6 (g), 10.4.
  struct Row {
    int o, o_prev;
    char init;
    double ratio;
  };
  const std::vector<Row> others = {{1, 1, 0, 0.2}, {0, 2, 0, 1}, {3, 3, 1, 1}, {2, 2, 0, 0.2}};
  const std::vector<Row> firsts = {
      {0, 0, 0, 1},  // o = o'
      {1, 0, 0, 5},  // o is the o' of another row
      {3, 0, 0, 5},  // of an initial row, stale
      {0, 1, 0, 1},  // of none
      {1, 0, 1, 1},  // first state
  };
  for (const Row& first : firsts) {
    std::vector<Row> rows = {first};
    rows.insert(rows.end(), others.begin(), others.end());
    const auto algorithm = MakeRunAlgorithm(
        SmallConfig("dac_ppo", Fidelity::kReleased, {"ratio_clip=100"}), Sizes(5, 3));
    Rng rng(5, "batch");
    const Index B = Index(rows.size());
    Batch batch = RandomBatch(5, 3, 4, B, rng);
    for (std::size_t b = 0; b < rows.size(); ++b) {
      batch.o[b] = rows[b].o;
      batch.o_prev[b] = rows[b].o_prev;
      batch.init[b] = rows[b].init;
    }
    const Vec ratios = HighRatios(*algorithm, batch);
    for (Index b = 0; b < B; ++b) {
      const double expected = rows[std::size_t(b)].ratio;
      EXPECT_NEAR(ratios(b), expected, 0.02 * expected)  // heads of gain 1e-3
          << "row " << b << " below (" << first.o << ", " << first.o_prev << ")";
    }
  }
}

TEST(SumAndCount, OfReleasedDacIsOneWithTheMaskAndInTheLowStage) {
  EXPECT_EQ(Deviating("dac_ppo", Fidelity::kReleased, {"dac_update_mask=paper"}),
            (std::vector<double>{0, 0}));
  const std::vector<double> shares = Deviating("dac_ppo", Fidelity::kReleased, {});
  EXPECT_GT(shares[0], 0.3);  // options go on at more than half of the steps
  EXPECT_EQ(shares[1], 0);
}

TEST(SumAndCount, OfReleasedOption2VecDiffersByTheRedrawInTheActionStageAlone) {
  const auto shares =
      Deviating("option2vec", Fidelity::kReleased, {"o2v_dropout=0", "o2v_init_flag=paper"});
  EXPECT_EQ(shares[0], 0);
  EXPECT_GT(shares[1], 0.2);
}

TEST(SumAndCount, OfReleasedOption2VecDiffersWhereInitAndDoneDiffer) {
  const auto shares =
      Deviating("option2vec", Fidelity::kReleased, {"o2v_dropout=0", "o2v_option_in_update=paper"});
  // Episodes of 7 steps: first states (5 of 32 steps) and last states (4 of 32).
  EXPECT_DOUBLE_EQ(shares[0], 9.0 / 32);
  EXPECT_EQ(shares[1], 0);
}

TEST(SumAndCount, DiffersByTheMasksWithDropout) {
  const auto shares = Deviating("option2vec", Fidelity::kPaper, {"o2v_dropout=0.2"});
  EXPECT_GT(shares[0], 0.5);
  EXPECT_EQ(shares[1], 0);  // the action net has no dropout
}

}  // namespace
}  // namespace o2v
