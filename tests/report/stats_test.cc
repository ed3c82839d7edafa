#include "report/stats.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "base/check.h"

namespace o2v {
namespace {

constexpr std::array kFour = {1.0, 2.0, 3.0, 6.0};  // mean 3, deviations -2 -1 0 3

TEST(Stats, MeanAndPopulationStdOfFourValues) {
  EXPECT_EQ(Mean(kFour), 3);
  EXPECT_DOUBLE_EQ(Std(kFour), std::sqrt(14.0 / 4));  // 4 + 1 + 0 + 9 = 14
}

TEST(Stats, StandardErrorDividesByTheRootOfTheCount) {
  EXPECT_DOUBLE_EQ(StdError(kFour), std::sqrt(14.0 / 4) / 2);
}

TEST(Stats, IqmLeavesOutTheOuterQuarters) {
  EXPECT_DOUBLE_EQ(Iqm(kFour), 2.5);  // 1 and 6 are a quarter each
  EXPECT_DOUBLE_EQ(Iqm(std::array{100.0, 3.0, 2.0, -50.0}), 2.5) << "order must not matter";
}

TEST(Stats, IqmCountsStraddlingValuesInPart) {
  // n = 5: the axis part [1.25, 3.75) holds 0.75 of the second, the third, 0.75 of the fourth
  // value.
  EXPECT_DOUBLE_EQ(Iqm(std::array{0.0, 1.0, 2.0, 4.0, 99.0}), (0.75 * 1 + 2 + 0.75 * 4) / 2.5);
  EXPECT_DOUBLE_EQ(Iqm(std::array{7.0}), 7);
}

TEST(Stats, BootstrapIntervalOfTwoValuesIsTheirRange) {
  // Means of two draws are 0, 1/2, 1 with probabilities 1/4, 1/2, 1/4: both tails exceed 2.5 %.
  const Interval ci = BootstrapInterval(std::array{0.0, 1.0}, 1);
  EXPECT_EQ(ci.low, 0);
  EXPECT_EQ(ci.high, 1);
}

TEST(Stats, BootstrapIntervalNearsTheNormalOneForManyValues) {
  std::vector<double> x;
  for (int i = 0; i < 400; ++i) x.push_back(i % 2 ? 1 : -1);  // mean 0, std 1
  const Interval ci = BootstrapInterval(x, 2);
  EXPECT_NEAR(ci.low, -1.96 / 20, 0.01);
  EXPECT_NEAR(ci.high, 1.96 / 20, 0.01);
}

TEST(Stats, BootstrapIntervalIsAFunctionOfTheSeed) {
  const Interval a = BootstrapInterval(kFour, 3), b = BootstrapInterval(kFour, 3);
  EXPECT_EQ(a.low, b.low);
  EXPECT_EQ(a.high, b.high);
}

TEST(Stats, EmptyInputIsRefused) {
  const std::vector<double> none;
  EXPECT_THROW(Mean(none), Error);
  EXPECT_THROW(Std(none), Error);
  EXPECT_THROW(StdError(none), Error);
  EXPECT_THROW(Iqm(none), Error);
  EXPECT_THROW(BootstrapInterval(none, 0), Error);
}

}  // namespace
}  // namespace o2v
