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
    algorithm.Serialize(*this);
  }
  void Matrix(std::string_view name, Mat& x) override {
    if (name.starts_with("target.")) target.push_back(x);
  }
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view, std::int64_t*, std::size_t) override {}

  std::vector<Mat> online, target;
};

/// Iterations of T steps, numbered from 1, at whose end the target has new weights.
std::vector<int> Copies(int workers, int every, int T, int iterations) {
  const RunConfig config = SmallConfig(
      "oc", Fidelity::kPaper,
      {Concat("rollout=", T), Concat("target_every=", every), Concat("workers=", workers)});
  VecEnv env = PointTask(config.workers, /*time_limit=*/9);
  const auto algorithm = MakeRunAlgorithm(config, env.Spec());
  std::vector<Mat> target = Weights(*algorithm).online;
  std::vector<int> copies;
  for (int iteration = 1; iteration <= iterations; ++iteration) {
    const std::vector<Mat> acting = Weights(*algorithm).online;
    Iterate(*algorithm, env);
    const Weights now(*algorithm);
    EXPECT_NE(now.online, acting);
    if (now.target != target) {
      EXPECT_EQ(now.target, acting) << "a copy takes the weights that the rollout runs with";
      copies.push_back(iteration);
    }
    target = now.target;
  }
  return copies;
}

TEST(OptionCritic, CopiesItsTargetAtMultiplesOfStepsAWorker) {
  using Iterations = std::vector<int>;
  // Step by step, whatever divisors the number of workers and the interval share. A copy after the
  // first iteration cannot be seen: the target starts with the weights of that rollout.
  EXPECT_EQ(Copies(/*workers=*/4, /*every=*/6, /*T=*/1, 20), (Iterations{6, 12, 18}));
  EXPECT_EQ(Copies(6, 4, 1, 13), (Iterations{4, 8, 12}));
  EXPECT_EQ(Copies(2, 4, 1, 13), (Iterations{4, 8, 12}));
  EXPECT_EQ(Copies(4, 8, 1, 17), (Iterations{8, 16}));
  EXPECT_EQ(Copies(3, 7, 1, 15), (Iterations{7, 14}));
  // Steps 6, 12, ... of a worker, 5 an iteration: none in 1..5, 31..35 and 61..65.
  EXPECT_EQ(Copies(4, 6, 5, 13), (Iterations{2, 3, 4, 5, 6, 8, 9, 10, 11, 12}));
  // Steps 10, 20, ...: the last of every other iteration.
  EXPECT_EQ(Copies(5, 10, 5, 6), (Iterations{2, 4, 6}));
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
