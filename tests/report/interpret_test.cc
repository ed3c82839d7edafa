#include "report/interpret.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "algo/setup.h"
#include "run/evaluate.h"
#include "run/fake_run.h"
#include "small_hyper.h"

namespace o2v {
namespace {

/// The message of the error that `f` throws.
template <typename Thrown>
std::string Message(const std::function<void()>& f) {
  try {
    f();
  } catch (const Thrown& e) {
    return e.what();
  }
  return "nothing was thrown";
}

std::unique_ptr<Algorithm> Make(const std::string& method, const Settings& hyper) {
  AlgorithmInput in;
  in.S = 2;
  in.A = 1;
  in.hyper = &hyper;
  return MakeAlgorithm(method, in);
}

/// Option2Vec with K = D = h = 2 on the fake task, all else of no influence:
///   W_o = (1 3; 2 -1), an episode's first option is 0, all others are 1,
///   mu = tanh((0.2, -0.1) ReLU((1 0; 0.5 1) ReLU((0.1 0.2; 0.3 -0.2) o_hat))), sigma = 0.
/// |mu| < 0.1 moves the point by less than 0.7, so every episode has the 7 steps of the limit.
class Interpreter : public testing::Test {
 protected:
  Interpreter() {
    for (Param* p : algorithm_->Params()) p->value.setZero();
    Value("embed.W_o") << 1, 3, 2, -1;
    Value("init.1.b") << 100, 0;
    Value("logits.b") << 0, 100;
    Value("action.body.0.W").rightCols(2) << Real(0.1), Real(0.2), Real(0.3), Real(-0.2);
    Value("action.body.1.W") << 1, 0, Real(0.5), 1;
    Value("action.mu.W") << Real(0.2), Real(-0.1);
    Value("action.sigma.b").setConstant(-100);
  }
  Mat& Value(const std::string& name) { return FindParam(*algorithm_, name).value; }
  Interpretation Run(double delta) {
    return Interpret(*algorithm_, normalizer_, env_, /*episodes=*/3, delta, /*seed=*/1);
  }

  const Settings hyper_ = SmallHyper({{"options", 2}, {"embedding", 2}, {"hidden", 2}});
  FakeEnv env_;
  std::unique_ptr<Algorithm> algorithm_ = Make("option2vec", hyper_);
  Normalizer normalizer_{2};
};

// Option 0: first layer (0.5, -0.1), of which the ReLU keeps (0.5, 0); then (0.5, 0.25);
//   mu = tanh(0.1 - 0.025) = tanh(0.075).
// Option 1: (0.1, 1.1); (0.1, 1.15); mu = tanh(0.02 - 0.115) = tanh(-0.095).
// W_mu W_1 = (0.15, -0.1). An episode has one state with option 0 and six with option 1.

/// Fails when it is asked with a perturbed embedding.
class Fragile final : public FakeAlgorithm {
 public:
  using FakeAlgorithm::FakeAlgorithm;
  Param W_o{"W_o", 2, 2};
  Param* Embedding() override { return &W_o; }
  void MeanJacobian(const Mat&, const std::vector<int>&, MatD& J) override { J.setZero(1, 2); }
  void ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) override {
    Check((W_o.value.array() == 0).all(), "perturbed");
    FakeAlgorithm::ActionPolicy(s, o, mu, sigma);
  }
};

TEST_F(Interpreter, RestoresTheEmbeddingWhenAQueryFails) {
  Fragile fragile(env_.Spec(), 1);
  EXPECT_EQ(Message<Error>([&] { Interpret(fragile, normalizer_, env_, 1, 0.5, 1); }), "perturbed");
  EXPECT_EQ(fragile.W_o.value, Mat::Zero(2, 2));
}

TEST_F(Interpreter, AveragesTheDerivativeOverVisitedStates) {
  const Interpretation x = Run(0.5);
  EXPECT_EQ(x.states, 21);
  // Option 0: (0.15, 0) W_e = (0.015, 0.03); option 1: (0.15, -0.1) W_e = (-0.015, 0.05).
  const auto mean = [](double option_0, double option_1) {
    const double slope_0 = 1 - std::pow(std::tanh(0.075), 2);
    const double slope_1 = 1 - std::pow(std::tanh(-0.095), 2);
    return (slope_0 * option_0 + 6 * slope_1 * option_1) / 7;
  };
  ASSERT_EQ(x.effect.size(), 2);
  EXPECT_NEAR(x.effect(0, 0), mean(0.015, -0.015), 1e-8);
  EXPECT_NEAR(x.effect(1, 0), mean(0.03, 0.05), 1e-8);
}

TEST_F(Interpreter, PerturbsTheExecutedOptionsEmbedding) {
  const Interpretation x = Run(0.5);
  // Dimension 0, option 0, o_hat = (1.5, 2): (0.55, 0.05), beyond the kink; (0.55, 0.325); 0.0775.
  //              option 1, (3.5, -1): (0.15, 1.25); (0.15, 1.325); -0.1025.
  // Dimension 1, option 0, (1, 2.5): (0.6, -0.2), kept (0.6, 0); (0.6, 0.3); 0.09.
  //              option 1, (3, -0.5): (0.2, 1); (0.2, 1.1); -0.07.
  const auto mean = [](double option_0, double option_1) {
    return (std::tanh(option_0) - std::tanh(0.075) +
            6 * (std::tanh(option_1) - std::tanh(-0.095))) /
           7;
  };
  ASSERT_EQ(x.perturbed.size(), 2);
  EXPECT_NEAR(x.perturbed(0, 0), mean(0.0775, -0.1025), 1e-8);
  EXPECT_NEAR(x.perturbed(1, 0), mean(0.09, -0.07), 1e-8);
  EXPECT_EQ(x.delta, 0.5);
}

TEST_F(Interpreter, LeavesTheNetworkAsItWas) {
  const Mat W_o = Value("embed.W_o");
  const Interpretation x = Run(1e8);  // 1 is lost in it: adding and subtracting is not enough
  EXPECT_TRUE(Value("embed.W_o") == W_o);
  EXPECT_TRUE(x.W_o == W_o.cast<double>());
  EXPECT_EQ(InterpretationCsv(x), InterpretationCsv(Run(1e8)));
}

TEST_F(Interpreter, VisitsWhatSampledActionsDo) {
  // sigma = 5: pushed to and fro by 1 a step, the point is often beyond 2 before the limit.
  Value("action.sigma.b").setConstant(5);
  Index expected = 0;
  for (const EvalEpisode& e : Evaluate(*algorithm_, normalizer_, env_, 3, true, /*seed=*/1)) {
    expected += e.length;
  }
  EXPECT_LT(expected, 21) << "of mean actions";
  EXPECT_EQ(Run(0.5).states, expected);
}

TEST_F(Interpreter, RefusesWhatItCannotDo) {
  for (const double delta : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_NE(Message<Error>([&] { Run(delta); }).find("delta is "), std::string::npos) << delta;
  }
  for (const std::string& method : MethodIds()) {
    if (method == "option2vec") continue;
    const auto other = Make(method, hyper_);
    EXPECT_EQ(other->Embedding(), nullptr) << method;
    EXPECT_EQ(Message<Error>([&] { Interpret(*other, normalizer_, env_, 1, 1, 1); }),
              "interpret: the method's options have no embedding")
        << method;
    MatD J;
    EXPECT_THROW(other->MeanJacobian(Mat::Zero(2, 1), {0}, J), Error) << method;
  }
}

TEST(Interpretation, HasARowADimension) {
  Interpretation x;  // D = 2, K = 3, A = 2
  x.W_o = MatD{{1, 2, 3}, {4, 5, 6}};
  x.effect = MatD{{0.5, -0.5}, {0.25, 7}};
  x.perturbed = MatD{{8, 9}, {10, 11}};
  x.delta = 0.125;
  EXPECT_EQ(InterpretationCsv(x),
            "dimension,embedding_0,embedding_1,embedding_2,effect_0,effect_1,perturbed_0,"
            "perturbed_1,delta\n"
            "0,1,2,3,0.5,-0.5,8,9,0.125\n"
            "1,4,5,6,0.25,7,10,11,0.125\n");
}

TEST(Interpretation, SaysHowItWasMade) {
  Interpretation x;
  x.states = 3000;
  const auto json = nlohmann::json::parse(
      InterpretationJson(x, {{"config", "[run]\n"}, {"total_steps", "2048"}}, "Hopper-v2", 10, 4));
  for (const char* key : {"commit", "compiler", "flags", "versions"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_EQ(json["task"], "Hopper-v2");
  EXPECT_EQ(json["episodes"], 10);
  EXPECT_EQ(json["seed"], 4);
  EXPECT_EQ(json["states"], 3000);
  EXPECT_EQ(json["steps"], 2048);
  EXPECT_EQ(json["config"], "[run]\n");
  EXPECT_FALSE(
      nlohmann::json::parse(InterpretationJson(x, {}, "Hopper-v2", 10, 4)).contains("config"))
      << "weights from elsewhere";
  EXPECT_EQ(Message<Error>([&] {
              InterpretationJson(x, {{"total_steps", "9x"}}, "t", 1, 0);
            }),
            "checkpoint: total_steps is '9x', not a whole number");
}

TEST(Interpretation, IsKeptByFidelityDeviationsTaskAndSeed) {
  RunConfig config = SmallConfig("option2vec", Fidelity::kReleased);
  config.seed = 7;
  EXPECT_EQ(InterpretationPath(config, "Hopper-v2"),
            "results/interpret/released/Hopper-v2/option2vec/seed-007.csv");
  config.switches.o2v_dropout = 0;
  config.switches.o2v_freeze = Freeze::kNone;  // of transfer runs only: of no influence
  config.seed = 1234;
  EXPECT_EQ(InterpretationPath(config, "Hopper-v2"),
            "results/interpret/released-o2v_dropout=0/Hopper-v2/option2vec/seed-1234.csv");
}

}  // namespace
}  // namespace o2v
