#include "dist/diag_gaussian.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/check.h"
#include "random_mat.h"

namespace o2v {
namespace {

const double kHalfLog2Pi = 0.5 * std::log(2 * std::numbers::pi);

TEST(GaussianLogProb, WorkedExample) {
  Mat a(2, 1), mu(2, 1), sigma(2, 1);
  a << 1, 3;
  mu << 0, 4;
  sigma << 2, Real(0.5);
  Vec logp;
  GaussianLogProb(a, mu, sigma, logp);
  // z = 1/2 and -2: -(1/4 + 4)/2; -ln 2 and +ln 2 cancel.
  EXPECT_NEAR(logp(0), -2.125 - 2 * kHalfLog2Pi, 1e-6);
}

TEST(GaussianLogProb, SharedSigmaIsTheSameForAllColumns) {
  Rng rng(1, "test");
  const Mat a = RandomMat(3, 6, rng), mu = RandomMat(3, 6, rng);
  const Mat sigma = RandomMat(3, 1, rng).array().exp();
  Vec shared, repeated;
  GaussianLogProb(a, mu, sigma, shared);
  GaussianLogProb(a, mu, sigma.replicate(1, 6), repeated);
  EXPECT_EQ(shared, repeated);
}

TEST(GaussianLogProb, RefusesShapesThatDoNotFit) {
  Vec logp;
  EXPECT_THROW(GaussianLogProb(Mat::Zero(2, 3), Mat::Zero(2, 3), Mat::Ones(2, 2), logp), Error);
  EXPECT_THROW(GaussianLogProb(Mat::Zero(2, 3), Mat::Zero(2, 4), Mat::Ones(2, 4), logp), Error);
}

TEST(GaussianMeanEntropy, WorkedExample) {
  Mat sigma(1, 2);
  sigma << 1, 4;  // mean of ln sigma: ln 2
  EXPECT_NEAR(GaussianMeanEntropy(sigma), 0.5 + kHalfLog2Pi + std::log(2.0), 1e-6);
}

TEST(GaussianMeanEntropy, IsTheMeanOfMinusTheLogDensity) {
  Rng rng(2, "test");
  constexpr Index n = 20000;
  Mat sigma(2, 1), a;
  sigma << Real(0.3), 2;
  const Mat mu = RandomMat(2, 1, rng).replicate(1, n);
  SampleGaussian(mu, sigma, rng, a);
  Vec logp;
  GaussianLogProb(a, mu, sigma, logp);
  // logp varies by two halves of a squared normal: variance 1.
  EXPECT_NEAR(-logp.mean(), GaussianMeanEntropy(sigma), 5 / std::sqrt(double(n)));
}

TEST(SampleGaussian, HasItsMeanAndDeviation) {
  Rng rng(3, "test");
  constexpr Index n = 20000;
  Mat sigma(2, n), a;
  sigma.row(0).setConstant(Real(0.5));
  sigma.row(1).setConstant(3);
  Mat mu(2, n);
  mu.row(0).setConstant(-1);
  mu.row(1).setConstant(2);
  SampleGaussian(mu, sigma, rng, a);
  for (Index j = 0; j < 2; ++j) {
    const double s = double(sigma(j, 0)), root = std::sqrt(double(n));
    const double mean = double(a.row(j).mean());
    const double var = double((a.row(j).array() - Real(mean)).square().mean());
    EXPECT_NEAR(mean, mu(j, 0), 5 * s / root);
    EXPECT_NEAR(var, s * s, 5 * std::sqrt(2.0) * s * s / root);
  }
}

TEST(SampleGaussian, ShiftsAndScalesBoxMullersNormals) {
  // a = mu + sigma sqrt(-2 ln(1 - u)) cos(2 pi v), u and v drawn in this order.
  Rng rng(5, "test"), again(5, "test");
  Mat mu(2, 3), sigma(2, 3), a;
  mu << 1, 2, 3, -4, -5, -6;
  sigma << 0.5, 1, 2, 3, 0.25, 4;
  SampleGaussian(mu, sigma, rng, a);
  for (Index i = 0; i < 6; ++i) {
    const double u = again.Uniform(), v = again.Uniform();
    const double z = std::sqrt(-2 * std::log(1 - u)) * std::cos(2 * std::numbers::pi * v);
    EXPECT_NEAR(a.data()[i], double(mu.data()[i]) + double(sigma.data()[i]) * z, 1e-5);
  }
  SampleGaussian(mu, sigma.col(1), rng, a);  // one sigma for all columns
  for (Index i = 0; i < 6; ++i) {
    const double u = again.Uniform(), v = again.Uniform();
    const double z = std::sqrt(-2 * std::log(1 - u)) * std::cos(2 * std::numbers::pi * v);
    EXPECT_NEAR(a.data()[i], double(mu.data()[i]) + (i % 2 ? 0.25 : 1) * z, 1e-5);
  }
}

TEST(SampleGaussian, DrawsColumnByColumn) {
  Rng rng(4, "test"), again(4, "test");
  Mat a;
  SampleGaussian(Mat::Zero(2, 2), Mat::Ones(2, 1), rng, a);
  for (Index i = 0; i < 4; ++i) EXPECT_EQ(a.data()[i], static_cast<Real>(again.Normal()));
}

}  // namespace
}  // namespace o2v
