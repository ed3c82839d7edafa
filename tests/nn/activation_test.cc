#include "nn/activation.h"

#include <gtest/gtest.h>

#include <cmath>

namespace o2v {
namespace {

Mat Column(std::initializer_list<double> entries) {
  Mat x(Index(entries.size()), 1);
  Index i = 0;
  for (const double e : entries) x(i++) = Real(e);
  return x;
}

TEST(BiasActivate, AddsTheBiasToEveryColumnBeforeTanh) {
  Mat y(2, 2);
  y << 0, 1, 2, 3;
  BiasActivate(Activation::kTanh, Column({1, -2}), y);
  EXPECT_NEAR(y(0, 0), std::tanh(1.0), 1e-6);
  EXPECT_NEAR(y(0, 1), std::tanh(2.0), 1e-6);
  EXPECT_NEAR(y(1, 0), 0, 1e-6);
  EXPECT_NEAR(y(1, 1), std::tanh(1.0), 1e-6);
}

TEST(BiasActivate, ReluCutsBelowZero) {
  Mat y = Column({-3, 1, 2});
  BiasActivate(Activation::kRelu, Column({1, 1, -2}), y);
  EXPECT_EQ(y, Column({0, 2, 0}));
}

TEST(ActivationBackward, IsZeroAtTheKinkOfRelu) {
  Mat dy = Column({5, 5});
  ActivationBackward(Activation::kRelu, Column({0, 2}), dy);
  EXPECT_EQ(dy, Column({0, 5}));
}

TEST(Softplus, IsLogOfOnePlusExp) {
  Mat y = Column({0, 1, -1});
  Softplus(y);
  EXPECT_NEAR(y(0), std::log(2.0), 1e-6);
  EXPECT_NEAR(y(1), std::log1p(std::exp(1.0)), 1e-6);
  EXPECT_NEAR(y(2), std::log1p(std::exp(-1.0)), 1e-6);
}

TEST(Softplus, LiesAboveTheLineBelowTwenty) {
  Mat y = Column({3, 6, 9});
  Softplus(y);
  // x + ln(1 + e^-x).
  EXPECT_NEAR(y(0), 3.0485874, 1e-6);
  EXPECT_NEAR(y(1), 6.0024757, 1e-6);
  EXPECT_NEAR(y(2), 9.0001234, 2e-6);
}

TEST(Softplus, DoesNotOverflow) {
  Mat y = Column({21, 500, -500}), dy = Column({1, 1, 1});
  Softplus(y);
  EXPECT_EQ(y, Column({21, 500, 0}));
  SoftplusBackward(y, dy);
  EXPECT_NEAR(dy(0), 1, 1e-6);
  EXPECT_EQ(dy(1), 1);
  EXPECT_EQ(dy(2), 0);
}

TEST(Activations, OfNoSamplesTouchNothing) {
  Mat guarded = Mat::Constant(3, 2, 7);  // a block of no columns lies before the second
  MatRef none = guarded.middleCols(1, 0);
  for (const Activation g : {Activation::kTanh, Activation::kRelu}) {
    BiasActivate(g, Mat::Ones(3, 1), none);
    ActivationBackward(g, none, none);
  }
  Tanh(none);
  Softplus(none);
  SoftplusBackward(none, none);
  Sigmoid(none);
  SigmoidBackward(none, none);
  Mat nowhere(3, 0);  // has no memory
  Softplus(nowhere);
  Sigmoid(nowhere);
  Tanh(nowhere);
  EXPECT_EQ(guarded, Mat::Constant(3, 2, 7));
}

TEST(Sigmoid, IsAHalfAtZeroAndDoesNotOverflow) {
  Mat y = Column({0, 500, -500, 2});
  Sigmoid(y);
  EXPECT_EQ(y(0), Real(0.5));
  EXPECT_EQ(y(1), 1);
  EXPECT_EQ(y(2), 0);
  EXPECT_NEAR(y(3), 1 / (1 + std::exp(-2.0)), 1e-6);
}

}  // namespace
}  // namespace o2v
