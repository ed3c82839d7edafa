#include "run/evaluate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "fake_run.h"
#include "run/checkpoint.h"

namespace o2v {
namespace {

class Evaluation : public testing::Test {
 protected:
  std::vector<double> Returns(bool sample_action, std::uint64_t seed) {
    std::vector<double> returns;
    for (const EvalEpisode& e : Evaluate(algorithm_, normalizer_, env_, 5, sample_action, seed)) {
      returns.push_back(e.ret);
    }
    return returns;
  }

  FakeEnv env_;
  FakeAlgorithm algorithm_{env_.Spec(), 1};
  Normalizer normalizer_{2};
};

TEST_F(Evaluation, IsFixedByItsSeed) {
  for (const bool sample : {true, false}) {
    const auto first = Returns(sample, 7);
    EXPECT_EQ(first.size(), 5u);
    EXPECT_EQ(Returns(sample, 7), first);
    EXPECT_NE(Returns(sample, 8), first);
  }
  EXPECT_NE(Returns(true, 7), Returns(false, 7));
}

TEST_F(Evaluation, ChangesNeitherLearnerNorStatistics) {
  TestFolder dir;
  const auto save = [&] {
    SaveCheckpoint(dir / "x", {}, algorithm_, [&](StateVisitor& v) {
      algorithm_.Serialize(v);
      normalizer_.Serialize(v);
    });
    return ReadFile(dir / "x");
  };
  const std::string before = save();
  Returns(true, 7);
  EXPECT_TRUE(save() == before);
}

/// Always draws option 1.
class SecondOption final : public FakeAlgorithm {
 public:
  using FakeAlgorithm::FakeAlgorithm;
  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override {
    EXPECT_EQ(o_prev[0], init[0] && first_ ? 0 : 1);  // stale at an episode's start
    first_ = false;
    P.resize(2, s.cols());
    P << 0, 1;
  }

 private:
  bool first_ = true;
};

TEST_F(Evaluation, ActsWithTheDrawnOptionClippedToTheControlRange) {
  // mu = 3 + o = 4 is clipped to 1, so x rises by 1 a step from x0 in [-1, 1) and the episode ends
  // when it passes 2: after 2 steps from x0 > 0, else after 3.
  SecondOption algorithm(env_.Spec(), 1);
  algorithm.Params()[0]->value.setZero();
  algorithm.Params()[1]->value.setConstant(3);
  for (const EvalEpisode& e : Evaluate(algorithm, normalizer_, env_, 20, false, 5)) {
    // x0 from the return -(x0+1)^2 - (x0+2)^2 = -(2 x0^2 + 6 x0 + 5), or with (x0+3)^2 as well.
    const double x0 =
        e.length == 2 ? (-3 + std::sqrt(-1 - 2 * e.ret)) / 2 : -2 + std::sqrt((-e.ret - 2) / 3);
    EXPECT_EQ(e.length, x0 > 0 ? 2 : 3) << x0;
    EXPECT_LE(std::abs(x0), 1);
  }
}

TEST_F(Evaluation, ClipsToTheRangeOfTheTaskWhateverThatIs) {
  // Keeps the actions.
  struct Ranged final : Env {
    explicit Ranged(double low, double high) {
      spec = FakeEnv().Spec();
      spec.a_low = {low};
      spec.a_high = {high};
    }
    const EnvSpec& Spec() const override { return spec; }
    void Reset(Rng& rng, std::span<double> obs) override { env.Reset(rng, obs); }
    StepResult Step(std::span<const double> a, std::span<double> obs) override {
      actions.insert(a[0]);
      return env.Step(a, obs);
    }
    void Serialize(StateVisitor&, const std::string&) override {}
    EnvSpec spec;
    FakeEnv env;
    std::set<double> actions;
  };
  algorithm_.Params()[0]->value.setZero();
  for (const auto& [low, high] : {std::pair{-3.0, 0.4}, {-0.25, 5.0}}) {
    for (const double mu : {-100.0, 100.0}) {
      Ranged env(low, high);
      algorithm_.Params()[1]->value.setConstant(Real(mu));
      Evaluate(algorithm_, normalizer_, env, 3, /*sample_action=*/true, 5);
      EXPECT_EQ(env.actions, (std::set<double>{mu < 0 ? low : high}));
    }
  }
}

TEST_F(Evaluation, AddsNoiseToSampledActionsOnly) {
  // mu = 0, sigma = 0.5: mean actions leave the point where it is for 7 steps, and each costs
  // x0^2. Sampled ones are those of the stream "eval.action".
  struct FirstOption final : FakeAlgorithm {
    using FakeAlgorithm::FakeAlgorithm;
    void OptionPolicy(const Mat&, const std::vector<int>&, const std::vector<char>&,
                      Mat& P) override {
      P = Mat::Zero(2, 1);
      P(0) = 1;
    }
  } algorithm(env_.Spec(), 1);
  for (Param* p : algorithm.Params()) p->value.setZero();
  Rng resets(5, "eval.reset"), actions(5, "eval.action");
  const auto mean = Evaluate(algorithm, normalizer_, env_, 4, /*sample_action=*/false, 5);
  const auto sampled = Evaluate(algorithm, normalizer_, env_, 4, /*sample_action=*/true, 5);
  for (std::size_t i = 0; i < 4; ++i) {
    const double x0 = resets.Uniform(-1, 1);
    EXPECT_EQ(mean[i].length, 7);
    EXPECT_NEAR(mean[i].ret, -7 * x0 * x0, 1e-12);
    double x = x0, ret = 0;
    int length = 0;
    while (length < 7 && std::abs(x) <= 2) {
      x += std::clamp(0.5 * actions.Normal(), -1.0, 1.0);
      ret -= x * x;
      ++length;
    }
    EXPECT_EQ(sampled[i].length, length);
    EXPECT_NEAR(sampled[i].ret, ret, 1e-12);
  }
}

TEST_F(Evaluation, TrajectoriesHoldEveryStep) {
  // Always option 1 and mu = -0.75 + 1, from x0 on: state (x, t) before the step, x + 0.25 after.
  SecondOption algorithm(env_.Spec(), 1);
  algorithm.Params()[0]->value.setZero();
  algorithm.Params()[1]->value.setConstant(Real(-0.75));
  CsvTable table = NewTrajectory(env_.Spec(), 2);
  EXPECT_EQ(table.columns, (std::vector<std::string>{"episode", "step", "o", "P0", "P1", "a0",
                                                     "reward", "obs0", "obs1"}));
  Evaluate(algorithm, normalizer_, env_, 2, /*sample_action=*/false, 5,
           [&](const EvalStep& step) { Append(step, table); });
  std::vector<double> expected;
  Rng resets(5, "eval.reset");
  for (const double episode : {0, 1}) {
    double x = resets.Uniform(-1, 1);
    for (double t = 0; t < 7 && x <= 2; ++t) {
      const double next = x + 0.25;
      expected.insert(expected.end(), {episode, t, 1, 0, 1, 0.25, -next * next, x, t});
      x = next;
    }
  }
  EXPECT_EQ(table.values, expected);
}

TEST_F(Evaluation, ForwardWritesTheNetworksOutputs) {
  TestFolder dir;
  algorithm_.Params()[0]->value << Real(0.5), Real(0.25);
  algorithm_.Params()[1]->value << 1;
  WriteFileAtomically(dir / "in.csv", "o,s0,s1,o_prev,init\n0,2,4,1,0\n1,-1,0,0,1\n");
  Forward(algorithm_, env_.Spec(), dir / "in.csv", dir / "out.csv");
  // mu = 0.5 s0 + 0.25 s1 + 1 + o; P of o_prev 1, then of an initial state; q = (s0, s1 + o).
  EXPECT_EQ(ReadFile(dir / "out.csv"),
            "P0,P1,mu0,sigma0,q0,q1\n0.25,0.75,3,0.5,2,4\n0.5,0.5,1.5,0.5,-1,1\n");
}

TEST_F(Evaluation, ForwardRefusesBadInputs) {
  TestFolder dir;
  for (const char* text : {
           "s0,s1,o_prev,init\n1,2,0,0\n",          // a column too few
           "s0,s1,o_prev,init,o,x\n1,2,0,0,0,0\n",  // one too many
           "s0,s2,o_prev,init,o\n1,2,0,0,0\n",      // a wrong one
           "s0,s1,o_prev,init,o\n1,2,0,0,2\n",      // option out of range
           "s0,s1,o_prev,init,o\n1,2,-1,0,0\n",     //
           "s0,s1,o_prev,init,o\n1,2,0.5,0,0\n",    // not whole
           "s0,s1,o_prev,init,o\n1,2,0,2,0\n",      // flag
       }) {
    WriteFileAtomically(dir / "in.csv", text);
    EXPECT_THROW(Forward(algorithm_, env_.Spec(), dir / "in.csv", dir / "out.csv"), Error) << text;
    EXPECT_FALSE(std::filesystem::exists(dir / "out.csv"));
  }
}

}  // namespace
}  // namespace o2v
