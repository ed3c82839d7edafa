#include "dist/diag_gaussian.h"

#include <numbers>

#include "base/check.h"

namespace o2v {
namespace {

/// 1/2 ln 2 pi.
const double kHalfLog2Pi = 0.5 * std::log(2 * std::numbers::pi);

void CheckShapes(const Mat& a, const Mat& mu, const Mat& sigma) {
  Check(a.rows() == mu.rows() && a.cols() == mu.cols() && sigma.rows() == mu.rows() &&
            (sigma.cols() == mu.cols() || sigma.cols() == 1),
        "Gaussian: got a (", a.rows(), ", ", a.cols(), "), mu (", mu.rows(), ", ", mu.cols(),
        "), sigma (", sigma.rows(), ", ", sigma.cols(), ")");
}

}  // namespace

void GaussianLogProb(const Mat& a, const Mat& mu, const Mat& sigma, Vec& logp) {
  CheckShapes(a, mu, sigma);
  logp.resize(a.cols());
  const Index shared = sigma.cols() == 1 ? 0 : 1;
  for (Index b = 0; b < a.cols(); ++b) {
    const auto s = sigma.col(b * shared).array();
    const auto z = (a.col(b) - mu.col(b)).array() / s;
    logp(b) = (Real(-0.5) * z.square() - s.log() - Real(kHalfLog2Pi)).sum();
  }
}

void GaussianLogProbGrad(const Mat& a, const Mat& mu, const Mat& sigma, const Vec& dlogp, Mat& dmu,
                         Mat& dsigma) {
  CheckShapes(a, mu, sigma);
  dmu.resize(mu.rows(), mu.cols());
  dsigma.setZero(sigma.rows(), sigma.cols());
  const Index shared = sigma.cols() == 1 ? 0 : 1;
  for (Index b = 0; b < a.cols(); ++b) {
    const auto s = sigma.col(b * shared).array();
    const auto d = (a.col(b) - mu.col(b)).array();
    dmu.col(b) = dlogp(b) * d / s.square();
    dsigma.col(b * shared).array() += dlogp(b) * (d.square() / s.square() - 1) / s;
  }
}

double GaussianMeanEntropy(const Mat& sigma) {
  const double constant = static_cast<double>(sigma.rows()) * (0.5 + kHalfLog2Pi);
  return constant +
         static_cast<double>(sigma.array().log().sum()) / static_cast<double>(sigma.cols());
}

void AddGaussianEntropyGrad(const Mat& sigma, Real dH, Mat& dsigma) {
  dsigma.array() += dH / static_cast<Real>(sigma.cols()) * sigma.array().inverse();
}

void SampleGaussian(const Mat& mu, const Mat& sigma, Rng& rng, Mat& a) {
  a.resize(mu.rows(), mu.cols());
  const Index shared = sigma.cols() == 1 ? 0 : 1;
  for (Index b = 0; b < mu.cols(); ++b) {
    for (Index j = 0; j < mu.rows(); ++j) {
      a(j, b) = mu(j, b) + sigma(j, b * shared) * static_cast<Real>(rng.Normal());
    }
  }
}

}  // namespace o2v
