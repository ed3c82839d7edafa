// What all methods save and answer alike.

#include "algo/method.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "algo/setup.h"

namespace o2v {
namespace {

/// Names of the whole numbers that a learner saves and that begin with "rng.".
class Streams final : public StateVisitor, public std::set<std::string> {
 public:
  void Matrix(std::string_view, Mat&) override {}
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view name, std::int64_t*, std::size_t) override {
    if (name.starts_with("rng.")) emplace(name.substr(4));
  }
};

TEST(Method, SavesEveryRandomStreamThatItDrawsFrom) {
  using Names = std::set<std::string>;
  const std::map<std::string, Names> expected = {
      {"ppo", {"policy", "shuffle"}},
      {"ahp_ppo", {"policy", "shuffle"}},
      {"ppoc", {"policy", "shuffle", "bootstrap"}},
      {"oc", {"policy"}},
      {"iopg", {"policy"}},
      {"dac_ppo", {"policy", "shuffle", "bootstrap", "order"}},
      {"dac_onestep", {"policy", "shuffle", "bootstrap", "order"}},
      {"option2vec", {"policy", "shuffle", "bootstrap", "order", "dropout", "redraw"}}};
  for (const std::string& method : MethodIds()) {
    const auto algorithm = MakeRunAlgorithm(SmallConfig(method, Fidelity::kPaper), Sizes(5, 3));
    Streams streams;
    algorithm->Serialize(streams);
    EXPECT_EQ(streams, expected.at(method)) << method;
  }
}

TEST(Method, OptionValuesAreTheFirstOutputsOfItsCritic) {
  // All weights 0 and the biases of the heads 10, 11, ...: AHP's fifth output, of first states, is
  // none of an option.
  for (const std::string& method : MethodIds()) {
    if (method == "option2vec") continue;  // which has a critic of its own
    const auto algorithm = MakeRunAlgorithm(SmallConfig(method, Fidelity::kPaper), Sizes(5, 3));
    for (Param* p : algorithm->Params()) {
      p->value.setZero();
      if (p->name != "critic.q.b" && p->name != "critic.u.b" && p->name != "critic.v.b") continue;
      for (Index k = 0; k < p->value.size(); ++k) p->value(k) = Real(10 + k);
    }
    Mat q;
    algorithm->OptionValues(Mat::Ones(5, 2), {0, 0}, q);
    const Index K = algorithm->NumOptions();
    ASSERT_EQ(q.rows(), K) << method;
    ASSERT_EQ(q.cols(), 2) << method;
    for (Index k = 0; k < K; ++k) EXPECT_EQ(q(k, 0), Real(10 + k)) << method;
    EXPECT_EQ(q.col(1), q.col(0)) << method;
  }
}

/// Makes everything zero that a learner has of matrices, IOPG's copies included.
class Zeros final : public StateVisitor {
 public:
  void Matrix(std::string_view, Mat& x) override { x.setZero(); }
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view, std::int64_t*, std::size_t) override {}
};

TEST(Method, AnswersWithTheWeightsOfTheMoment) {
  // sigma = softplus(rho) = ln 2 at 0 and ln(1 + e) at 1; so of Option2Vec's bias, whose weights
  // are zero here.
  for (const std::string& method : MethodIds()) {
    const auto algorithm = MakeRunAlgorithm(SmallConfig(method, Fidelity::kPaper), Sizes(5, 3));
    for (Param* p : algorithm->Params()) p->value.setZero();
    Mat mu, sigma;
    for (const double rho : {0, 1}) {
      for (Param* p : algorithm->Params()) {
        if (p->name.ends_with("rho") || p->name == "action.sigma.b")
          p->value.setConstant(Real(rho));
      }
      algorithm->ActionPolicy(Mat::Ones(5, 2), {0, 0}, mu, sigma);
      EXPECT_LT((sigma.array() - Real(std::log1p(std::exp(rho)))).abs().maxCoeff(), 1e-6) << method;
    }
  }
}

TEST(Ppo, ReportsTheLossThatItMinimises) {
  const auto algorithm =
      MakeRunAlgorithm(SmallConfig("ppo", Fidelity::kPaper, {"entropy_weight=0.5"}), Sizes(5, 3));
  Rng rng(6, "batch");
  const LossTerms terms = algorithm->Loss(0, RandomBatch(5, 3, 1, 24, rng), nullptr);
  EXPECT_GT(terms.entropy, 1) << "of three dimensions with sigma near ln 2";
  EXPECT_NEAR(terms.total, terms.surrogate - 0.5 * terms.entropy + terms.value, 1e-9);
}

/// All but the master policies, which choose option 2, is zero; and what is saved of the workers.
class Chosen final : public StateVisitor {
 public:
  std::map<std::string, std::int64_t> first;  // number of each array
  void Matrix(std::string_view name, Mat& x) override {
    x.setZero();
    if (name.ends_with("master.head.b")) x(2) = 100;
  }
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view name, std::int64_t* x, std::size_t) override {
    first[std::string(name)] = x[0];
  }
};

TEST(Iopg, SavesTheOptionsThatItsWorkersAreIn) {
  EnvSpec sizes = Sizes(1, 1);
  sizes.time_limit = 20;
  const auto algorithm = MakeRunAlgorithm(SmallConfig("iopg", Fidelity::kPaper), sizes);
  Chosen chosen;
  algorithm->Serialize(chosen);
  int made = 0;
  VecEnv env([&] { return std::make_unique<PointEnv>(made++ ? 9 : 4); }, 2, /*seed=*/4);
  env.Reset();
  std::vector<Episode> episodes;
  algorithm->Collect(env, episodes);  // worker 0 has ended, worker 1 is in its fifth step
  algorithm->Update();
  algorithm->Serialize(chosen);
  for (const auto& [name, value] : {std::pair{"copy0.o_prev", 2},
                                    {"copy1.o_prev", 2},
                                    {"copy0.length", 0},
                                    {"copy1.length", 4}}) {
    ASSERT_TRUE(chosen.first.contains(name)) << name;
    EXPECT_EQ(chosen.first.at(name), value) << name;
  }
}

TEST(Iopg, CountsAnExecutionForEveryChangeOfOption) {
  // Terminations of 1/2 and four equal options: a step changes the option with probability 3/8. In
  // 400 steps 399 * 3/8 = 150 changes are expected, with a deviation of 9.7.
  RunConfig config = SmallConfig("iopg", Fidelity::kPaper, {"workers=1"});
  EnvSpec sizes = Sizes(1, 1);
  sizes.time_limit = 400;
  const auto algorithm = MakeRunAlgorithm(config, sizes);
  Zeros zeros;
  algorithm->Serialize(zeros);
  VecEnv env([] { return std::make_unique<PointEnv>(400); }, 1, /*seed=*/4);
  env.Reset();
  std::vector<Episode> episodes;
  algorithm->Collect(env, episodes);
  const std::vector<SumAndCount>& stats = algorithm->Update();
  const std::vector<std::string> names = algorithm->StatNames();
  double steps = 0, executions = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!names[i].starts_with("duration_")) continue;
    steps += stats[i].sum;
    executions += stats[i].n;
  }
  EXPECT_EQ(steps, 400);
  EXPECT_NEAR(executions, 1 + 150, 5 * 9.7);
}

TEST(Switches, ThatAreNumbersHaveBoundsWhichAreTaken) {
  const auto dropout = [](const std::string& value) {
    Switches switches;
    SetSwitch(switches, "option2vec", "o2v_dropout", value);
    return switches.o2v_dropout;
  };
  EXPECT_EQ(dropout("0"), 0);
  EXPECT_EQ(dropout("0.9"), 0.9);
  for (const char* value : {"0.91", "1", "1e9", "-0.1", "-1e-9", "nan", ""}) {
    EXPECT_THROW(dropout(value), ConfigError) << value;
  }
}

}  // namespace
}  // namespace o2v
