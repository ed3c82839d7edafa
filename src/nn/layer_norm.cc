#include "nn/layer_norm.h"

#include <cmath>

#include "base/check.h"

namespace o2v {
namespace {

constexpr Real kEps = Real(1e-5);  // spec 2.1

/// Sums over a column in the lanes of vector registers. Columns are short (n = D), so that block
/// expressions of run-time size would cost more than the sums themselves.
using Lanes = Eigen::Array<Real, 8, 1>;
constexpr Index kLanes = Lanes::SizeAtCompileTime;
Eigen::Map<Lanes> At(Real* x) { return Eigen::Map<Lanes>(x); }
Eigen::Map<const Lanes> At(const Real* x) { return Eigen::Map<const Lanes>(x); }

}  // namespace

void LayerNorm::Forward(const ConstMatRef& x, Cache& cache, MatRef y) const {
  Check(x.rows() == gain.value.rows(), gain.name, ": got ", x.rows(), " rows, not ",
        gain.value.rows());
  const Index n = x.rows(), B = x.cols(), whole = n - n % kLanes;
  cache.x_hat.resize(n, B);
  cache.inv_std.resize(B);
  const Real n_inv = Real(1) / static_cast<Real>(n);
  const Real* g = gain.value.data();
  const Real* b = shift.value.data();
  Real* inv_std = cache.inv_std.data();
  for (Index j = 0; j < B; ++j) {
    const Real* xj = x.data() + j * x.outerStride();
    Real* x_hat = cache.x_hat.data() + j * n;
    Lanes partial = Lanes::Zero();
    for (Index i = 0; i < whole; i += kLanes) partial += At(xj + i);
    Real sum = partial.sum();
    for (Index i = whole; i < n; ++i) sum += xj[i];
    const Real mean = sum * n_inv;
    partial.setZero();
    for (Index i = 0; i < whole; i += kLanes) {
      At(x_hat + i) = At(xj + i) - mean;
      partial += At(x_hat + i).square();
    }
    Real squares = partial.sum();
    for (Index i = whole; i < n; ++i) {
      x_hat[i] = xj[i] - mean;
      squares += x_hat[i] * x_hat[i];
    }
    inv_std[j] = squares;
  }
  for (Index j = 0; j < B; ++j) inv_std[j] = 1 / std::sqrt(inv_std[j] * n_inv + kEps);
  for (Index j = 0; j < B; ++j) {
    Real* x_hat = cache.x_hat.data() + j * n;
    Real* yj = y.data() + j * y.outerStride();
    for (Index i = 0; i < n; ++i) {
      x_hat[i] *= inv_std[j];
      yj[i] = g[i] * x_hat[i] + b[i];
    }
  }
}

void LayerNorm::Backward(const Cache& cache, const ConstMatRef& dy, MatRef dx) {
  AddGrad(cache, dy);
  const Index n = dy.rows(), whole = n - n % kLanes;
  const Real n_inv = Real(1) / static_cast<Real>(n);
  const Real* g = gain.value.data();
  for (Index j = 0; j < dy.cols(); ++j) {
    // h = gain * dy:  dx = (h - mean(h) - x_hat mean(h x_hat)) / std; spec 3.6
    const Real* dyj = dy.data() + j * dy.outerStride();
    const Real* x_hat = cache.x_hat.data() + j * n;
    Real* h = dx.data() + j * dx.outerStride();
    Lanes sums = Lanes::Zero(), dots = Lanes::Zero();
    for (Index i = 0; i < whole; i += kLanes) {
      At(h + i) = At(g + i) * At(dyj + i);
      sums += At(h + i);
      dots += At(h + i) * At(x_hat + i);
    }
    Real sum = sums.sum(), dot = dots.sum();
    for (Index i = whole; i < n; ++i) {
      h[i] = g[i] * dyj[i];
      sum += h[i];
      dot += h[i] * x_hat[i];
    }
    const Real mean = sum * n_inv, along = dot * n_inv, inv_std = cache.inv_std(j);
    for (Index i = 0; i < n; ++i) h[i] = (h[i] - mean - along * x_hat[i]) * inv_std;
  }
}

void LayerNorm::AddGrad(const Cache& cache, const ConstMatRef& dy) {
  const Index n = dy.rows();
  Real* dgain = gain.grad.data();
  Real* dshift = shift.grad.data();
  for (Index j = 0; j < dy.cols(); ++j) {
    const Real* dyj = dy.data() + j * dy.outerStride();
    const Real* x_hat = cache.x_hat.data() + j * n;
    for (Index i = 0; i < n; ++i) {
      dgain[i] += dyj[i] * x_hat[i];
      dshift[i] += dyj[i];
    }
  }
}

}  // namespace o2v
