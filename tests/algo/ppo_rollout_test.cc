// What a rollout makes of rewards, ends of episodes and values (spec 1.3).

#include <gtest/gtest.h>

#include "algo/ppo_core.h"
#include "algo/toy.h"
#include "small_hyper.h"

namespace o2v {
namespace {

constexpr int kWorkers = 2, kSteps = 12;
constexpr double kGamma = 0.5;
constexpr int kLimits[kWorkers] = {5, 7};  // [steps] of the workers' episodes

/// A rollout of two critics on points that nobody moves. The values of states that were acted at
/// are 10 and 20; those of other states 100 and 200.
struct AtRest {
  int made = 0;
  VecEnv env{[this] { return std::make_unique<PointEnv>(kLimits[made++]); }, kWorkers, /*seed=*/3};
  Settings hyper = SmallHyper({{"rollout", kSteps}, {"minibatch", 5}, {"gamma", kGamma}});
  std::unique_ptr<PpoRollout> rollout;
  std::vector<Episode> episodes;
  int samples = 0;

  explicit AtRest(Fidelity timelimit) {
    AlgorithmInput in;
    in.S = in.A = 1;
    in.workers = kWorkers;
    in.hyper = &hyper;
    in.switches.timelimit = timelimit;
    rollout = std::make_unique<PpoRollout>(in, /*critics=*/2);
    rollout->a = Mat::Zero(1, kWorkers);
    env.Reset();
    const auto set = [&](Index row, Index n, double v) {
      Eigen::Map<VecD>(rollout->critics[0].v.data() + row, n).setConstant(v);
      Eigen::Map<VecD>(rollout->critics[1].v.data() + row, n).setConstant(2 * v);
    };
    const auto value = [&](Index row, Index n) {
      set(row, n, 10);
      samples += int(n);
    };
    const auto value_next = [&](const Mat&, std::span<const char>) {
      set(rollout->batch.Size(), kWorkers, 100);
    };
    rollout->Collect(
        env, episodes, [](Index) {}, value, value_next);
  }
};

TEST(PpoRollout, BootstrapsTheWorkerThatReachedItsTimeLimit) {
  // Rewards lie in [-1, 0]; gamma v = 50 for the first critic, 100 for the second.
  const AtRest paper(Fidelity::kPaper), released(Fidelity::kReleased);
  for (int i = 0; i < kWorkers; ++i) {
    for (int t = 0; t < kSteps; ++t) {
      const double r = released.rollout->critics[0].r(i, t);
      EXPECT_LE(std::abs(r), 1);
      EXPECT_EQ(released.rollout->critics[1].r(i, t), r);
      const bool end = (t + 1) % kLimits[i] == 0;
      EXPECT_EQ(paper.rollout->critics[0].r(i, t), r + (end ? 50 : 0)) << i << ", step " << t;
      EXPECT_EQ(paper.rollout->critics[1].r(i, t), r + (end ? 100 : 0)) << i << ", step " << t;
      EXPECT_EQ(paper.rollout->mask(i, t), end ? 0 : 1);
      EXPECT_EQ(released.rollout->mask(i, t), end ? 0 : 1);
    }
  }
}

TEST(PpoRollout, ValuesEverySampleAndTheStatesAfterThem) {
  const AtRest paper(Fidelity::kPaper);
  EXPECT_EQ(paper.samples, kWorkers * kSteps);
  const MatD& v = paper.rollout->critics[1].v;
  EXPECT_EQ(v.leftCols(kSteps), MatD::Constant(kWorkers, kSteps, 20));
  EXPECT_EQ(v.col(kSteps), VecD::Constant(kWorkers, 200));
}

TEST(PpoRollout, GivesTheFirstOfTwoCriticsTheHighStream) {
  // R_T = r_T + gamma v_T at the last step: neither worker's episode ends there.
  const AtRest paper(Fidelity::kPaper);
  const Batch& batch = paper.rollout->batch;
  for (int i = 0; i < kWorkers; ++i) {
    const Index row = Index(kSteps - 1) * kWorkers + i;
    const double r = paper.rollout->critics[0].r(i, kSteps - 1);
    EXPECT_NEAR(double(batch.high.ret(row)), r + 50, 1e-5);
    EXPECT_NEAR(double(batch.low.ret(row)), r + 100, 1e-5);
  }
}

TEST(PpoRollout, HoldsTheValuesOfOptions) {
  // V_bar = sum_k p_k q_k, and q of the option taken.
  AtRest paper(Fidelity::kPaper);
  Mat p(2, 2), q(2, 2);
  p << 0.25, 0.5, 0.75, 0.5;
  q << 4, 6, 8, 2;
  paper.rollout->SetOptionValues(p, q, std::vector<int>{1, 0}, /*row=*/kWorkers);
  EXPECT_EQ(paper.rollout->critics[0].v.col(1), (VecD(2) << 7, 4).finished());
  EXPECT_EQ(paper.rollout->critics[1].v.col(1), (VecD(2) << 8, 6).finished());
}

}  // namespace
}  // namespace o2v
