#include "nn/init.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace o2v {

void Orthogonal(Mat& W, double gain, Rng& rng) {
  const bool wide = W.rows() <= W.cols();
  const Index n = std::max(W.rows(), W.cols()), m = std::min(W.rows(), W.cols());
  MatD gauss(n, m);
  for (Index j = 0; j < m; ++j) {
    for (Index i = 0; i < n; ++i) gauss(i, j) = rng.Normal();
  }
  const Eigen::HouseholderQR<MatD> qr(gauss);
  MatD Q = qr.householderQ() * MatD::Identity(n, m);
  for (Index j = 0; j < m; ++j) {
    if (qr.matrixQR()(j, j) < 0) Q.col(j) *= -1;
  }
  if (wide) {
    W = (gain * Q.transpose()).cast<Real>();
  } else {
    W = (gain * Q).cast<Real>();
  }
}

void XavierUniform(Mat& W, Index fan_in, Index fan_out, Rng& rng) {
  Uniform(W, std::sqrt(6.0 / static_cast<double>(fan_in + fan_out)), rng);
}

void XavierUniform(Mat& W, Rng& rng) { XavierUniform(W, W.cols(), W.rows(), rng); }

void Uniform(Mat& W, double a, Rng& rng) {
  for (Index j = 0; j < W.cols(); ++j) {
    for (Index i = 0; i < W.rows(); ++i) W(i, j) = static_cast<Real>(rng.Uniform(-a, a));
  }
}

void Initialiser::Orthogonal(Mat& W, double gain) const {
  if (rng_) o2v::Orthogonal(W, gain, *rng_);
}

void Initialiser::XavierUniform(Mat& W) const {
  if (rng_) o2v::XavierUniform(W, *rng_);
}

void Initialiser::XavierUniform(Mat& W, Index fan_in, Index fan_out) const {
  if (rng_) o2v::XavierUniform(W, fan_in, fan_out, *rng_);
}

void Initialiser::Uniform(Mat& W, double a) const {
  if (rng_) o2v::Uniform(W, a, *rng_);
}

}  // namespace o2v
