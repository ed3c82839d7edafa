// When OC's target network takes over the weights (spec 4.3 (f)).

#include <gtest/gtest.h>

#include "algo/setup.h"

namespace o2v {
namespace {

/// Keeps both networks, in the order of the parameters.
class Weights final : public StateVisitor {
 public:
  explicit Weights(Algorithm& algorithm) {
    for (const Param* p : algorithm.Params()) online.push_back(p->value);
    algorithm.Visit(*this);
  }
  void Matrix(std::string_view name, Mat& x) override {
    if (name.starts_with("target.")) target.push_back(x);
  }
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view, std::int64_t*, std::size_t) override {}

  std::vector<Mat> online, target;
};

TEST(OptionCritic, CopiesItsTargetAtMultiplesOfStepsAWorker) {
  // Rollouts of 5 steps a worker, a copy after steps 7, 14, ... of a worker: it takes the weights
  // that the rollout runs with.
  const int every = 7, T = 5;
  const RunConfig config =
      SmallConfig("oc", Fidelity::kPaper, {"rollout=5", "target_every=7", "workers=3"});
  VecEnv env = PointTask(config.workers, /*time_limit=*/9);
  const auto algorithm = MakeRunAlgorithm(config, env.Spec());
  std::vector<Mat> expected = Weights(*algorithm).online;
  int copies = 0, kept = 0;
  for (int step = 0; step < 14 * T; step += T) {
    const std::vector<Mat> acting = Weights(*algorithm).online;
    const bool copy = (step + T) / every > step / every;
    if (copy) expected = acting;
    Iterate(*algorithm, env);
    const Weights now(*algorithm);
    ASSERT_EQ(now.target.size(), now.online.size());
    EXPECT_EQ(now.target, expected) << "after step " << step + T;
    EXPECT_NE(now.online, acting);
    (copy ? copies : kept) += 1;
  }
  EXPECT_EQ(copies, 10);
  EXPECT_EQ(kept, 4);
}

/// The value loss on a batch of ours after `value` was written into the online network's `tensor`.
double ValueLossWith(const std::string& tensor, double value) {
  const auto algorithm = MakeRunAlgorithm(SmallConfig("oc", Fidelity::kPaper), Sizes(5, 3));
  Rng rng(5, "batch");
  Batch batch = RandomBatch(5, 3, 4, 24, rng);
  batch.mask.setOnes();
  FindParam(*algorithm, tensor).value.setConstant(Real(value));
  return algorithm->Loss(0, batch, nullptr).value;
}

TEST(OptionCritic, BootstrapsWithItsTarget) {
  // 1/2 mean (q_o + d - R)^2 has the second difference 1 in d when R does not move with it.
  const char* q = "critic.q.b";
  EXPECT_NEAR(ValueLossWith(q, 1) - 2 * ValueLossWith(q, 0) + ValueLossWith(q, -1), 1, 1e-4);
  const char* beta = "option1.beta.head.b";
  EXPECT_EQ(ValueLossWith(beta, 2), ValueLossWith(beta, 0));
}

}  // namespace
}  // namespace o2v
