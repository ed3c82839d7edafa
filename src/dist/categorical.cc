#include "dist/categorical.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace o2v {

void LogSoftmax(const ConstMatRef& z, Mat& log_P, Mat& P) {
  log_P.resize(z.rows(), z.cols());
  P.resize(z.rows(), z.cols());
  const Index K = z.rows();
  for (Index b = 0; b < z.cols(); ++b) {  // raw loops: K is too short for block expressions
    const Real* zb = z.data() + b * z.outerStride();
    Real* l = log_P.data() + b * K;
    Real largest = zb[0];
    for (Index k = 1; k < K; ++k) largest = std::max(largest, zb[k]);
    for (Index k = 0; k < K; ++k) l[k] = zb[k] - largest;
  }
  P = log_P.array().exp();
  for (Index b = 0; b < z.cols(); ++b) {
    Real* l = log_P.data() + b * K;
    Real* p = P.data() + b * K;
    Real sum = 0;
    for (Index k = 0; k < K; ++k) sum += p[k];
    const Real log_sum = std::log(sum);
    for (Index k = 0; k < K; ++k) {
      l[k] -= log_sum;
      p[k] /= sum;
    }
  }
}

void CategoricalEntropy(const Mat& log_P, const Mat& P, Vec& H) {
  H.resize(P.cols());
  for (Index b = 0; b < P.cols(); ++b) H(b) = -P.col(b).dot(log_P.col(b));
}

void AddLogProbGrad(const Mat& P, std::span<const int> o, const Vec& dlogp, Mat& dz) {
  Check(Index(o.size()) == P.cols() && dlogp.size() == P.cols(), "categorical: got ", o.size(),
        " options and ", dlogp.size(), " adjoints for ", P.cols(), " columns");
  for (Index b = 0; b < P.cols(); ++b) {
    dz.col(b) -= dlogp(b) * P.col(b);
    dz(o[std::size_t(b)], b) += dlogp(b);
  }
}

void AddEntropyGrad(const Mat& log_P, const Mat& P, const Vec& H, Real dH, Mat& dz) {
  for (Index b = 0; b < P.cols(); ++b) {
    dz.col(b).array() -= dH * P.col(b).array() * (log_P.col(b).array() + H(b));
  }
}

void SampleCategorical(const ConstMatRef& P, Rng& rng, std::span<int> o) {
  Check(Index(o.size()) == P.cols(), "categorical: got room for ", o.size(), " draws, not ",
        P.cols());
  for (Index b = 0; b < P.cols(); ++b) {
    double total = 0;
    for (Index k = 0; k < P.rows(); ++k) total += static_cast<double>(P(k, b));
    double left = rng.Uniform() * total;
    Index k = 0;
    while (k + 1 < P.rows() && left >= static_cast<double>(P(k, b))) {
      left -= static_cast<double>(P(k, b));
      ++k;
    }
    o[std::size_t(b)] = static_cast<int>(k);
  }
}

}  // namespace o2v
