// The gradient checker itself.

#include "grad_check.h"

#include <gtest/gtest.h>

#include "random_mat.h"

namespace o2v {
namespace {

/// Loss x_0^2 + x_1 at x = (3, 5) beside a given gradient; the true one is (6, 1).
Comparison Square(double g0, double g1, Expect expect = Expect::kGradient) {
  Rng rng(1, "test");
  Mat x(2, 1), g(2, 1);
  x << 3, 5;
  g << g0, g1;
  return Compare({{"x", x, g, [&] { return x(0) * x(0) + x(1); }, expect}}, rng);
}

TEST(GradCheck, PassesTheTrueGradient) {
  const Verdict verdict = RewardAndEnd(Square(6, 1));
  EXPECT_TRUE(verdict.Passed()) << verdict.largest_error;
  EXPECT_EQ(verdict.entries, 2u);
  EXPECT_EQ(verdict.largest_gradient, 6);
}

TEST(GradCheck, MeasuresTheErrorRelativeToTheLargerOfTheTwo) {
  EXPECT_NEAR(RewardAndEnd(Square(8, 1)).largest_error, 2.0 / 8, 1e-8);
  EXPECT_NEAR(RewardAndEnd(Square(4, 1)).largest_error, 2.0 / 6, 1e-8);
}

TEST(GradCheck, MeasuresSmallEntriesAgainstTheWholeStage) {
  // The second tensor's gradient is 1e-6, the stage's largest 1: the error is 1e-6 / 1e-3.
  Rng rng(2, "test");
  Mat x = Mat::Ones(1, 1), y = x, one = x, twice = Mat::Constant(1, 1, 2e-6);
  const auto loss = [&] { return x(0) + 1e-6 * y(0); };
  EXPECT_NEAR(
      RewardAndEnd(Compare({{"x", x, one, loss}, {"y", y, twice, loss}}, rng)).largest_error, 1e-3,
      1e-6);
}

TEST(GradCheck, CatchesOnePercentAndAWrongSign) {
  EXPECT_FALSE(RewardAndEnd(Square(6 * 1.01, 1)).Passed());
  EXPECT_FALSE(RewardAndEnd(Square(6, -1)).Passed());
  EXPECT_FALSE(RewardAndEnd(WithPlantedError(Square(6, 1), 0, 1.01)).Passed());
}

TEST(GradCheck, FailsATensorWithoutAnyGradient) {
  const Verdict verdict = RewardAndEnd(Square(0, 0));
  EXPECT_EQ(verdict.largest_error, std::numeric_limits<double>::infinity());
  EXPECT_EQ(verdict.worst, "x");
}

TEST(GradCheck, FailsWhatIsNotANumber) {
  EXPECT_FALSE(RewardAndEnd(Square(6, std::numeric_limits<double>::quiet_NaN())).Passed());
}

TEST(GradCheck, WantsDetachedTensorsExactlyZero) {
  EXPECT_TRUE(RewardAndEnd(Square(0, 0, Expect::kDetached)).Passed());
  EXPECT_FALSE(RewardAndEnd(Square(0, 1e-300, Expect::kDetached)).Passed());
}

TEST(GradCheck, AllowsRoundingWhereTheLossCannotMove) {
  EXPECT_TRUE(RewardAndEnd(Square(0, 1e-13, Expect::kShift)).Passed());
  EXPECT_FALSE(RewardAndEnd(Square(0, 1e-11, Expect::kShift)).Passed());
}

TEST(GradCheck, ComparesAsManyEntriesAsAskedTheLargestAmongThem) {
  Rng rng(3, "test");
  Mat x = RandomMat(10, 10, rng), g = 2 * x;
  g(4, 7) = x(4, 7) = 50;  // the true gradient there is 100
  const auto loss = [&] { return x.squaredNorm(); };
  const Comparison comparison = Compare({{"x", x, g, loss}}, rng, 21);
  EXPECT_EQ(comparison[0].analytic.size(), 21u);
  EXPECT_NEAR(RewardAndEnd(comparison).largest_error, 0.5, 1e-6);
}

TEST(GradCheck, LeavesTheValuesAsTheyWere) {
  Rng rng(4, "test");
  Mat x = RandomMat(3, 3, rng), g = 2 * x;
  const Mat before = x;
  Compare({{"x", x, g, [&] { return x.squaredNorm(); }}}, rng);
  EXPECT_EQ(x, before);
}

TEST(GradCheck, MergesTensorsByName) {
  Comparison all;
  Merge(Square(6, 1), all);
  Merge(Square(8, 1), all);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].largest, 8);
  EXPECT_NEAR(RewardAndEnd(all).largest_error, 2.0 / 8, 1e-8);
}

}  // namespace
}  // namespace o2v
