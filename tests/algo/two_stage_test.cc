// What a rollout of the two-stage methods makes of rewards, ends of episodes and values (spec 1.3).

#include "algo/two_stage.h"

#include <gtest/gtest.h>

#include "algo/toy.h"
#include "small_hyper.h"

namespace o2v {
namespace {

constexpr int kWorkers = 2, kSteps = 12, kMinibatch = 5;  // no last minibatch of kWorkers samples
constexpr double kGamma = 0.5;
constexpr int kLimits[kWorkers] = {5, 7};  // [steps] of the workers' episodes

/// Two options, drawn with probabilities 1/4 and 3/4. They are worth 8 and 24 at the states that
/// are acted at, 100 and 300 at other ones: 20 and 250 on average.
class AtRest final : public TwoStageMethod {
 public:
  explicit AtRest(const AlgorithmInput& in) : TwoStageMethod(in) {}

  const Rollout& rollout() const { return rollout_; }
  int samples = 0;  // valued

 private:
  OptionDistribution Options(const ConstMatRef& s, std::span<const int>,
                             std::span<const char>) override {
    P_.resize(2, s.cols());
    P_.row(0).setConstant(Real(0.25));
    P_.row(1).setConstant(Real(0.75));
    log_P_ = P_.array().log();
    return {P_, log_P_};
  }
  void DrawActions(const ConstMatRef&, std::span<const int>, Mat& a, Vec& logp) override {
    a.setZero();
    logp.setConstant(-3);
  }
  const Mat& Critic(const ConstMatRef& s, std::span<const int>) override {
    const bool other = s.cols() == kWorkers;
    if (!other) samples += int(s.cols());
    q_.resize(2, s.cols());
    q_.row(0).setConstant(other ? 100 : 8);
    q_.row(1).setConstant(other ? 300 : 24);
    return q_;
  }
  LossTerms OptionLoss(const Batch&, const FixedDraws*) override { return {}; }
  LossTerms ActionLoss(const Batch&, const FixedDraws*) override { return {}; }
  void OptionPolicy(const Mat&, const std::vector<int>&, const std::vector<char>&, Mat&) override {}

  Mat P_, log_P_, q_;
};

/// A rollout on points that nobody moves.
struct Rested {
  int made = 0;
  VecEnv env{[this] { return std::make_unique<PointEnv>(kLimits[made++]); }, kWorkers, /*seed=*/3};
  Settings hyper = SmallHyper(
      {{"rollout", kSteps}, {"minibatch", kMinibatch}, {"gamma", kGamma}, {"options", 2}});
  std::unique_ptr<AtRest> method;
  std::vector<Episode> episodes;

  explicit Rested(Fidelity timelimit) {
    AlgorithmInput in;
    in.S = in.A = 1;
    in.workers = kWorkers;
    in.hyper = &hyper;
    in.switches.timelimit = timelimit;
    method = std::make_unique<AtRest>(in);
    env.Reset();
    method->Collect(env, episodes);
  }
};

TEST(TwoStageMethod, BootstrapsTheWorkerThatReachedItsTimeLimit) {
  const Rested a(Fidelity::kPaper), b(Fidelity::kReleased);
  const Rollout &paper = a.method->rollout(), &released = b.method->rollout();
  for (int i = 0; i < kWorkers; ++i) {
    for (int t = 0; t < kSteps; ++t) {
      const double r = released.critics[0].r(i, t);
      EXPECT_LE(std::abs(r), 1);  // as all rewards of this task
      EXPECT_EQ(released.critics[1].r(i, t), r);
      const bool end = (t + 1) % kLimits[i] == 0;
      EXPECT_EQ(paper.critics[0].r(i, t), r + (end ? 125 : 0)) << i << ", step " << t;
      const double action = paper.critics[1].r(i, t) - r;  // gamma q of the option drawn
      EXPECT_TRUE(end ? std::abs(action - 50) < 1e-9 || std::abs(action - 150) < 1e-9 : action == 0)
          << action << ": " << i << ", step " << t;
      EXPECT_EQ(paper.mask(i, t), end ? 0 : 1);
      EXPECT_EQ(released.mask(i, t), end ? 0 : 1);
    }
  }
}

TEST(TwoStageMethod, ValuesEverySampleAndTheStatesAfterThem) {
  // V_bar = sum_k P_k q_k for the option stage, q of the option taken for the action stage.
  const Rested rested(Fidelity::kPaper);
  const Rollout& rollout = rested.method->rollout();
  EXPECT_EQ(rested.method->samples, kWorkers * kSteps);
  const MatD &option = rollout.critics[0].v, &action = rollout.critics[1].v;
  EXPECT_EQ(option.leftCols(kSteps), MatD::Constant(kWorkers, kSteps, 20));
  EXPECT_EQ(option.col(kSteps), VecD::Constant(kWorkers, 250));
  for (int b = 0; b < kWorkers * kSteps; ++b) {
    EXPECT_EQ(action.data()[b], rollout.batch.o[std::size_t(b)] == 0 ? 8 : 24) << b;
  }
}

TEST(TwoStageMethod, KeepsWhatWasDrawnWithItsProbability) {
  const Rested rested(Fidelity::kPaper);
  const Batch& batch = rested.method->rollout().batch;
  for (int b = 0; b < kWorkers * kSteps; ++b) {
    const int o = batch.o[std::size_t(b)];
    EXPECT_EQ(batch.P_old(o, b), Real(o == 0 ? 0.25 : 0.75));
    EXPECT_NEAR(double(batch.option.logp_old(b)), std::log(o == 0 ? 0.25 : 0.75), 1e-6);
    EXPECT_EQ(batch.action.logp_old(b), -3);
  }
}

TEST(TwoStageMethod, GivesEachStageTheReturnOfItsOwnCritic) {
  // R_T = r_T + gamma v_T at the last step: neither worker's episode ends there.
  const Rested rested(Fidelity::kPaper);
  const Rollout& rollout = rested.method->rollout();
  for (int i = 0; i < kWorkers; ++i) {
    const Index row = Index(kSteps - 1) * kWorkers + i;
    const double r = rollout.critics[0].r(i, kSteps - 1);
    EXPECT_NEAR(double(rollout.batch.option.ret(row)), r + 125, 1e-4);
    EXPECT_NEAR(double(rollout.batch.action.ret(row)), r + kGamma * rollout.critics[1].v(i, kSteps),
                1e-4);
    EXPECT_NE(rollout.critics[1].v(i, kSteps), 250);
  }
}

}  // namespace
}  // namespace o2v
