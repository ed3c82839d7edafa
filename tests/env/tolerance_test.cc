// Worked values; source of the formulas: spec E.3.

#include "env/tolerance.h"

#include <gtest/gtest.h>

namespace o2v {
namespace {

constexpr double kRounding = 1e-15;

TEST(Tolerance, IsOneInsideTheBoundsAndOnThem) {
  for (const Sigmoid sigmoid : {Sigmoid::kGaussian, Sigmoid::kLinear, Sigmoid::kQuadratic}) {
    for (const double margin : {0.0, 0.5}) {
      for (const double x : {-1.0, 0.3, 2.0}) {
        EXPECT_EQ(Tolerance(x, {-1, 2}, margin, sigmoid), 1) << x;
      }
    }
  }
  EXPECT_EQ(Tolerance(1e300, {7, kInfinity}, 1), 1);
  EXPECT_EQ(Tolerance(4, {4, 4}), 1);
}

TEST(Tolerance, IsZeroOutsideWhenThereIsNoMargin) {
  EXPECT_EQ(Tolerance(2 + 1e-12, {-1, 2}), 0);
  EXPECT_EQ(Tolerance(-1 - 1e-12, {-1, 2}), 0);
}

TEST(Tolerance, FallsFromOneWithoutAJump) {
  for (const Sigmoid sigmoid : {Sigmoid::kGaussian, Sigmoid::kLinear, Sigmoid::kQuadratic}) {
    EXPECT_NEAR(Tolerance(2 + 1e-9, {-1, 2}, 0.5, sigmoid), 1, 1e-8);
  }
}

TEST(Tolerance, GaussianIsTheValueAtTheMarginToTheSquareOfTheDistance) {
  // exp(-(d s)^2 / 2) with s^2 = -2 ln v is v^(d^2); v = 0.1 unless said.
  EXPECT_NEAR(Tolerance(3, {1, 2}, 2), 0.56234132519034908, kRounding);  // d = 1/2: 0.1^(1/4)
  EXPECT_NEAR(Tolerance(4, {1, 2}, 2), 0.1, kRounding);                  // d = 1
  EXPECT_NEAR(Tolerance(-1, {1, 2}, 2), 0.1, kRounding);                 // d = 1, below
  EXPECT_NEAR(Tolerance(6, {1, 2}, 2), 1e-4, kRounding);                 // d = 2: 0.1^4
  EXPECT_NEAR(Tolerance(5, {1, 2}, 2, Sigmoid::kGaussian, 0.5), 0.21022410381342864,
              kRounding);  // d = 3/2: 0.5^(9/4)
}

TEST(Tolerance, LinearReachesTheValueAtTheMarginAndThenZero) {
  // 1 - (1 - v) d.
  EXPECT_NEAR(Tolerance(3, {1, 2}, 2, Sigmoid::kLinear), 0.55, kRounding);        // d = 1/2
  EXPECT_NEAR(Tolerance(4, {1, 2}, 2, Sigmoid::kLinear), 0.1, kRounding);         // d = 1
  EXPECT_NEAR(Tolerance(4, {1, 2}, 2, Sigmoid::kLinear, 0), 0, kRounding);        // d = 1
  EXPECT_NEAR(Tolerance(-2, {1, 2}, 2, Sigmoid::kLinear, 0.5), 0.25, kRounding);  // d = 3/2
  EXPECT_EQ(Tolerance(9, {1, 2}, 2, Sigmoid::kLinear, 0.5), 0);                   // d = 7/2
}

TEST(Tolerance, QuadraticReachesTheValueAtTheMarginAndThenZero) {
  // 1 - (1 - v) d^2.
  EXPECT_NEAR(Tolerance(3, {1, 2}, 2, Sigmoid::kQuadratic), 0.775, kRounding);    // d = 1/2
  EXPECT_NEAR(Tolerance(0, {1, 2}, 2, Sigmoid::kQuadratic, 0), 0.75, kRounding);  // d = 1/2, below
  EXPECT_NEAR(Tolerance(4, {1, 2}, 2, Sigmoid::kQuadratic), 0.1, kRounding);      // d = 1
  EXPECT_EQ(Tolerance(5, {1, 2}, 2, Sigmoid::kQuadratic), 0);                     // d = 3/2
}

}  // namespace
}  // namespace o2v
