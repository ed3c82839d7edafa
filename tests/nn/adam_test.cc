#include "nn/adam.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/check.h"
#include "memory_visitor.h"

namespace o2v {
namespace {

// Spec 1.4; a clip norm that clips nothing here.
constexpr Adam::Options kOptions = {3e-4, 0.9, 0.999, 1e-5, 100};

/// Two scalars.
struct Pair {
  Param x{"x", 1, 1}, y{"y", 1, 1};
  std::vector<Param*> Params() { return {&x, &y}; }
};

TEST(GradNorm, TakesAllTensorsTogether) {
  Param a("a", 1, 2), b("b", 2, 1);
  a.grad << 2, 4;
  b.grad << 5, 6;
  const std::vector<Param*> params = {&a, &b};
  EXPECT_NEAR(GradNorm(params), 9, 1e-6);  // sqrt(4 + 16 + 25 + 36)
}

TEST(ClipFactor, AddsAMillionthToTheNorm) {
  EXPECT_DOUBLE_EQ(ClipFactor(2, 0.5), 0.5 / (2 + 1e-6));
  // At the clip norm itself the millionth tips the scale.
  EXPECT_DOUBLE_EQ(ClipFactor(0.5, 0.5), 0.5 / (0.5 + 1e-6));
}

TEST(ClipFactor, LeavesSmallGradientsAlone) {
  EXPECT_EQ(ClipFactor(0.4, 0.5), 1);
  EXPECT_EQ(ClipFactor(0, 0.5), 1);
}

TEST(Adam, FirstStepIsTheLearningRateTimesTheSign) {
  Pair p;
  Adam adam(p.Params(), kOptions);
  p.x.grad << 2;
  p.y.grad << -1e-5f;
  adam.Step(std::vector<char>{1, 1}, IdleRule::kSkip);
  // m_hat = g, v_hat = g^2: lr g / (|g| + eps), half of lr where |g| = eps.
  EXPECT_NEAR(p.x.value(0), -3e-4 * 2 / (2 + 1e-5), 1e-10);
  EXPECT_NEAR(p.y.value(0), 1.5e-4, 1e-9);
}

TEST(Adam, SecondStepUsesTheCorrectedMoments) {
  Pair p;
  Adam adam(p.Params(), kOptions);
  p.x.grad << 1;
  adam.Step(std::vector<char>{1, 0}, IdleRule::kSkip);
  const double first = p.x.value(0);
  p.x.grad << 3;
  adam.Step(std::vector<char>{1, 0}, IdleRule::kSkip);
  // m = 0.9 0.1 + 0.1 3 = 0.39, / (1 - 0.81); v = 0.999 0.001 + 0.001 9 = 0.009999, / (1 -
  // 0.998001).
  const double m_hat = 0.39 / 0.19, v_hat = 0.009999 / 0.001999;
  EXPECT_NEAR(p.x.value(0) - first, -3e-4 * m_hat / (std::sqrt(v_hat) + 1e-5), 1e-9);
}

TEST(Adam, ClipsByTheNormOfAllTensors) {
  Pair p;
  Adam::Options options = kOptions;
  options.clip_norm = 1e-5;  // of the order of eps, so that the scale shows in the step
  Adam adam(p.Params(), options);
  p.x.grad << 3;
  p.y.grad << 4;
  EXPECT_NEAR(adam.Step(std::vector<char>{1, 1}, IdleRule::kSkip), 5, 1e-6);
  // Clipped to 0.6 and 0.8 of 1e-5.
  EXPECT_NEAR(p.x.value(0), -3e-4 * 0.6 / 1.6, 1e-9);
  EXPECT_NEAR(p.y.value(0), -3e-4 * 0.8 / 1.8, 1e-9);
}

TEST(Adam, ZeroesTheGradientsItUsed) {
  Pair p;
  Adam adam(p.Params(), kOptions);
  p.x.grad << 1;
  adam.Step(std::vector<char>{1, 1}, IdleRule::kSkip);
  EXPECT_EQ(p.x.grad(0), 0);
}

TEST(Adam, IdleTensorsDriftByTheirMomentumUnderZeroGradients) {
  Pair p;
  Adam adam(p.Params(), kOptions);
  p.x.grad << 1;
  adam.Step(std::vector<char>{1, 1}, IdleRule::kZeroGradient);
  // Spec 10.7: how far x has moved after one step and j idle ones, [1e-4].
  for (const double moved : {3.00, 5.01, 6.56, 7.84, 8.91, 9.84}) {
    EXPECT_NEAR(-1e4 * p.x.value(0), moved, 0.006);
    adam.Step(std::vector<char>{0, 1}, IdleRule::kZeroGradient);
  }
}

TEST(Adam, IdleTensorsRestUnderTheSkipRule) {
  Pair p;
  Adam adam(p.Params(), kOptions);
  p.x.grad << 1;
  adam.Step(std::vector<char>{1, 1}, IdleRule::kSkip);
  const Real before = p.x.value(0);
  adam.Step(std::vector<char>{0, 1}, IdleRule::kSkip);
  EXPECT_EQ(p.x.value(0), before);
}

TEST(Adam, FrozenTensorsRestUnderEveryRule) {
  for (const IdleRule idle : {IdleRule::kSkip, IdleRule::kZeroGradient}) {
    Pair p;
    Adam adam(p.Params(), kOptions);
    p.x.grad << 1;
    p.y.grad << 1;
    adam.Step(std::vector<char>{1, 1}, idle);
    const Real x = p.x.value(0), y = p.y.value(0);
    adam.Freeze(0);
    p.y.grad << 1;
    adam.Step(std::vector<char>{0, 1}, idle);
    EXPECT_EQ(p.x.value(0), x);
    EXPECT_LT(p.y.value(0), y);
  }
}

TEST(Adam, EveryTensorCountsItsOwnSteps) {
  for (const IdleRule idle : {IdleRule::kSkip, IdleRule::kZeroGradient}) {
    Pair p;
    Adam adam(p.Params(), kOptions);
    for (int i = 0; i < 5; ++i) {
      p.x.grad << 1;
      adam.Step(std::vector<char>{1, 0}, idle);
    }
    EXPECT_EQ(p.y.value(0), 0) << "a tensor without a first gradient does not move";
    p.y.grad << 1;
    adam.Step(std::vector<char>{0, 1}, idle);
    // Its first step, corrected with t = 1 and not 6 (which would give 1.4e-4).
    EXPECT_NEAR(p.y.value(0), -3e-4, 1e-8);
  }
}

TEST(Adam, RefusesFlagsForAnotherNumberOfTensors) {
  Pair p;
  Adam adam(p.Params(), kOptions);
  EXPECT_THROW(adam.Step(std::vector<char>{1}, IdleRule::kSkip), Error);
}

TEST(Adam, GoesOnFromAStateThatWasKept) {
  Pair p, q;
  Adam adam(p.Params(), kOptions), other(q.Params(), kOptions);
  const auto step = [](Pair& pair, Adam& optimiser, Real g) {
    pair.x.grad << g;
    optimiser.Step(std::vector<char>{1, 0}, IdleRule::kZeroGradient);
  };
  for (int i = 0; i < 3; ++i) step(p, adam, 1);
  MemoryVisitor kept;
  adam.Serialize(kept);
  kept.load = true;
  other.Serialize(kept);
  q.x.value = p.x.value;
  step(p, adam, -2);
  step(q, other, -2);
  EXPECT_EQ(p.x.value(0), q.x.value(0));
}

}  // namespace
}  // namespace o2v
