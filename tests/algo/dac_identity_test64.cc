// DAC-OneStep with P(o | s, o') := pi_hat is DAC (spec 5): same trajectories, advantages, targets
// and low stage, in double.

#include <gtest/gtest.h>

#include <cmath>

#include "algo/toy.h"
#include "small_hyper.h"

namespace o2v {
namespace {

constexpr int K = 4, kWorkers = 2;
constexpr double kTolerance = 1e-10;

/// Log-probabilities of a master policy, and logits of the terminations, that no state changes.
struct Constants {
  VecD log_pi = (VecD(K) << 0.1, 0.4, 0.3, 0.2).finished().array().log();
  VecD b = (VecD(K) << -1, 0.5, 2, -0.3).finished();
};

double Sigmoid(double b) { return 1 / (1 + std::exp(-b)); }

/// Both methods with the same option process, critic and intra-option policies, on one toy task.
class Pair {
 public:
  Pair(const std::map<std::string, double>& numbers, const Constants& constants)
      : hyper_(SmallHyper(numbers)) {
    for (int i : {0, 1}) {
      envs.push_back(PointTask(kWorkers, /*time_limit=*/7));
      AlgorithmInput in;
      in.S = in.A = 1;
      in.workers = kWorkers;
      in.hyper = &hyper_;
      in.seed = 1;
      methods.push_back(MakeAlgorithm(i == 0 ? "dac_ppo" : "dac_onestep", in));
    }
    // Heads without weights leave their biases.
    Set(0, "master.head.W").setZero();
    Set(0, "master.head.b") = constants.log_pi;
    for (int k = 0; k < K; ++k) {
      const std::string head = "option" + std::to_string(k) + ".beta.head.";
      Set(0, head + "W").setZero();
      Set(0, head + "b").setConstant(constants.b(k));
    }
    // Hidden unit j is tanh(tanh 1) after option j and 0 after another one or none.
    const double unit = std::tanh(std::tanh(1.0));
    Mat& layer0 = Set(1, "policy.body.0.W");
    Mat& layer1 = Set(1, "policy.body.1.W");
    Mat& head = Set(1, "policy.head.W");
    for (Mat* W : {&layer0, &layer1, &head}) W->setZero();
    Set(1, "policy.head.b") = constants.log_pi;
    for (int j = 0; j < K; ++j) {
      layer0(j, /*S=*/1 + j) = 1;
      layer1(j, j) = 1;
      const double beta = Sigmoid(constants.b(j));
      for (int k = 0; k < K; ++k) {
        const double pi_hat = (1 - beta) * (k == j) + beta * std::exp(constants.log_pi(k));
        head(k, j) = (std::log(pi_hat) - constants.log_pi(k)) / unit;
      }
    }
    for (Param* p : methods[1]->Params()) {
      if (Shared(p->name)) p->value = FindParam(*methods[0], p->name).value;
    }
  }

  /// Critic and intra-option policies.
  static bool Shared(const std::string& name) {
    return name.starts_with("critic.") || name.starts_with("option");
  }
  Mat& Set(std::size_t i, const std::string& name) { return FindParam(*methods[i], name).value; }
  /// The shared parameters of DAC and by how much those of OneStep differ at most.
  double Difference() {
    double largest = 0;
    for (const Param* p : methods[1]->Params()) {
      if (!Shared(p->name)) continue;
      largest = std::max(largest, (p->value - Set(0, p->name)).cwiseAbs().maxCoeff());
    }
    return largest;
  }

  std::vector<VecEnv> envs;
  std::vector<std::unique_ptr<Algorithm>> methods;  // DAC, OneStep

 private:
  Settings hyper_;
};

// Adam with a large eps moves by lr g / eps: the values after an update hold the gradients, not
// just their signs. A large clip_norm keeps the option policies' gradients, whose parameters
// differ, from scaling the others'.
const std::map<std::string, double> kLinearSteps = {
    {"adam_eps", 1e2}, {"learning_rate", 10}, {"clip_norm", 1e9}, {"rollout", 32}};

TEST(DacIdentity, OptionPoliciesAreEqual) {
  Pair pair({}, {});
  const Mat s = (Mat(1, 5) << -1, 0, 0.5, 2, 1).finished();
  const std::vector<int> o_prev = {0, 1, 2, 3, 1};
  const std::vector<char> init = {0, 0, 0, 0, 1};
  Mat P[2];
  for (int i : {0, 1}) pair.methods[std::size_t(i)]->OptionPolicy(s, o_prev, init, P[i]);
  EXPECT_LT((P[0] - P[1]).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_NEAR(P[0](1, 1), 1 - 0.6 * Sigmoid(0.5), 1e-15);  // (1 - beta) + 0.4 beta
  EXPECT_NEAR(P[0](1, 4), 0.4, 1e-15);
}

TEST(DacIdentity, LossesAndGradientsOfTheLowStageAreEqual) {
  Pair pair({}, {});
  Rng rng(5, "batch");
  const Batch batch = RandomBatch(1, 1, K, 64, rng);
  const LossTerms dac = pair.methods[0]->Loss(1, batch, nullptr);
  const LossTerms one = pair.methods[1]->Loss(1, batch, nullptr);
  EXPECT_EQ(dac.total, one.total);
  EXPECT_EQ(dac.surrogate, one.surrogate);
  for (const Param* p : pair.methods[1]->Params()) {
    if (Pair::Shared(p->name)) {
      EXPECT_EQ(p->grad, FindParam(*pair.methods[0], p->name).grad) << p->name;
      EXPECT_GT(p->grad.cwiseAbs().maxCoeff(), 0) << p->name;
    }
  }
}

TEST(DacIdentity, TrajectoriesTargetsAndLowAdvantagesAreEqual) {
  // After both stages critic and intra-option policies hold the targets of both streams and the
  // advantages of the low one.
  Pair pair(kLinearSteps, {});
  const Mat q = pair.Set(0, "critic.q.W"), mu = pair.Set(0, "option1.mu.head.W");
  std::vector<Episode> episodes[2];
  std::vector<double> stats[2];
  for (std::size_t i : {0, 1}) {
    pair.methods[i]->Collect(pair.envs[i], episodes[i]);
    for (const SumAndCount& ratio : pair.methods[i]->Update()) stats[i].push_back(ratio.Value());
  }
  EXPECT_EQ(pair.envs[0].States(), pair.envs[1].States());
  ASSERT_EQ(episodes[0].size(), 2u * (32 / 7));
  for (std::size_t e = 0; e < episodes[0].size(); ++e) {
    EXPECT_EQ(episodes[0][e].ret, episodes[1][e].ret);
  }
  EXPECT_LT(pair.Difference(), kTolerance);
  EXPECT_GT((pair.Set(0, "critic.q.W") - q).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_GT((pair.Set(0, "option1.mu.head.W") - mu).cwiseAbs().maxCoeff(), 1e-3);
  for (const char* name :
       {"value_loss_high", "value_loss_low", "surrogate_low", "usage_2", "duration_2_steps"}) {
    EXPECT_NEAR(Stat(*pair.methods[0], stats[0], name), Stat(*pair.methods[1], stats[1], name),
                kTolerance)
        << name;
  }
}

TEST(DacIdentity, HoldsForNoOtherTerminations) {
  Pair pair(kLinearSteps, {});
  pair.Set(0, "option2.beta.head.b").setConstant(-2);
  for (std::size_t i : {0, 1}) Iterate(*pair.methods[i], pair.envs[i]);
  EXPECT_GT(pair.Difference(), 1e-4);
}

TEST(DacIdentity, HighAdvantagesAreEqual) {
  // Where all options end (beta = 1 in double) both option policies are softmax(bias), so that the
  // first step of the high stage moves both biases alike. One step: later the weights differ.
  std::map<std::string, double> numbers = kLinearSteps;
  numbers.insert({{"epochs", 1}, {"minibatch", 32 * kWorkers}});
  Constants constants;
  constants.b.setConstant(40);
  Pair pair(numbers, constants);
  for (std::size_t i : {0, 1}) Iterate(*pair.methods[i], pair.envs[i]);
  const VecD dac = pair.Set(0, "master.head.b"), one = pair.Set(1, "policy.head.b");
  EXPECT_LT((dac - one).cwiseAbs().maxCoeff(), kTolerance);
  EXPECT_GT((dac - constants.log_pi).cwiseAbs().maxCoeff(), 1e-3);
}

}  // namespace
}  // namespace o2v
