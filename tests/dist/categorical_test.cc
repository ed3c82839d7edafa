#include "dist/categorical.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "random_mat.h"

namespace o2v {
namespace {

TEST(LogSoftmax, WorkedExample) {
  Mat z(2, 1), log_P, P;
  z << Real(std::log(3.0)), 0;
  LogSoftmax(z, log_P, P);
  EXPECT_NEAR(P(0), 0.75, 1e-6);
  EXPECT_NEAR(P(1), 0.25, 1e-6);
  EXPECT_NEAR(log_P(1), std::log(0.25), 1e-6);
}

TEST(LogSoftmax, SumsToOneAndIgnoresShifts) {
  Rng rng(1, "test");
  const Mat z = RandomMat(4, 50, rng, 3);
  Mat log_P, P, log_P_shifted, P_shifted;
  LogSoftmax(z, log_P, P);
  LogSoftmax(z.array() + 7, log_P_shifted, P_shifted);
  EXPECT_LT((P.colwise().sum().array() - 1).abs().maxCoeff(), 1e-6);
  EXPECT_LT((log_P - log_P_shifted).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(LogSoftmax, StaysFiniteForExtremeLogits) {
  Mat z(3, 3), log_P, P;
  z << 1000, -1000, 0,  //
      -1000, 0, 1000,   //
      0, 1000, -1000;
  LogSoftmax(z, log_P, P);
  for (Index b = 0; b < 3; ++b) {
    for (Index k = 0; k < 3; ++k) {
      EXPECT_EQ(log_P(k, b), z(k, b) - 1000);
      EXPECT_NEAR(P(k, b), z(k, b) == 1000 ? 1 : 0, 1e-38);  // Eigen's exp stops at 3e-39
    }
  }
}

TEST(LogSoftmax, PassesNanOn) {
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  Mat z(3, 3), log_P, P;
  z << nan, 1, 2,  //
      1, nan, 3,   //
      2, 3, nan;
  LogSoftmax(z, log_P, P);
  EXPECT_TRUE(log_P.array().isNaN().all());
  EXPECT_TRUE(P.array().isNaN().all());
}

TEST(CategoricalEntropy, LiesBetweenZeroAndLogK) {
  Rng rng(2, "test");
  Mat log_P, P;
  Vec H;
  LogSoftmax(RandomMat(4, 200, rng, 4), log_P, P);
  CategoricalEntropy(log_P, P, H);
  EXPECT_GE(H.minCoeff(), 0);
  EXPECT_LE(H.maxCoeff(), std::log(4.0) + 1e-6);
}

TEST(CategoricalEntropy, IsLogKForTheUniformAndZeroForACertainChoice) {
  Mat z(4, 2), log_P, P;
  Vec H;
  z << 5, 1000, 5, 0, 5, 0, 5, 0;
  LogSoftmax(z, log_P, P);
  CategoricalEntropy(log_P, P, H);
  EXPECT_NEAR(H(0), std::log(4.0), 1e-6);
  EXPECT_NEAR(H(1), 0, 1e-6);
}

TEST(SampleCategorical, DrawsAtItsProbabilities) {
  Rng rng(3, "test");
  constexpr int n = 20000;
  const std::array<double, 3> p = {0.2, 0.7, 0.1};
  Mat P(3, n);
  for (Index k = 0; k < 3; ++k) P.row(k).setConstant(Real(2 * p[std::size_t(k)]));  // sum 2
  std::vector<int> o(n);
  SampleCategorical(P, rng, o);
  std::array<int, 3> counts{};
  for (const int k : o) ++counts.at(std::size_t(k));
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(counts[k], n * p[k], 5 * std::sqrt(n * p[k] * (1 - p[k])));
  }
}

TEST(SampleCategorical, TakesTheFirstOptionWhosePartsExceedTheUniform) {
  // Probabilities 1/4, 1/2, 1/4 as 1, 2, 1: the draw is 0 below u = 1/4, 1 below 3/4, else 2.
  Rng rng(8, "test"), again(8, "test");
  constexpr int n = 1000;
  Mat P(3, n);
  P.colwise() = (Vec(3) << 1, 2, 1).finished();
  std::vector<int> o(n);
  SampleCategorical(P, rng, o);
  for (const int k : o) {
    const double u = again.Uniform();
    EXPECT_EQ(k, u < 0.25 ? 0 : u < 0.75 ? 1 : 2) << u;
  }
}

TEST(SampleCategorical, NeverDrawsWhatCannotHappen) {
  Rng rng(4, "test");
  Mat P = Mat::Zero(3, 1000);
  P.row(1).setOnes();
  std::vector<int> o(1000);
  SampleCategorical(P, rng, o);
  EXPECT_EQ(o, std::vector<int>(1000, 1));
}

TEST(SampleCategorical, TakesOneUniformAColumn) {
  Rng a(5, "test"), b(5, "test");
  std::vector<int> o(7);
  SampleCategorical(Mat::Ones(3, 7), a, o);
  for (int i = 0; i < 7; ++i) b.Uniform();
  EXPECT_EQ(a.Bits(), b.Bits());
}

TEST(SampleCategorical, RefusesRoomForAnotherNumberOfDraws) {
  Rng rng(6, "test");
  std::vector<int> o(2);
  EXPECT_THROW(SampleCategorical(Mat::Ones(3, 7), rng, o), Error);
}

}  // namespace
}  // namespace o2v
