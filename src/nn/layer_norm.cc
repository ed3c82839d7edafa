#include "nn/layer_norm.h"

#include <cmath>

#include "base/check.h"

namespace o2v {
namespace {

constexpr Real kEps = Real(1e-5);  // spec 2.1

}  // namespace

void LayerNorm::Forward(const ConstMatRef& x, Cache& cache, MatRef y) const {
  Check(x.rows() == gain.value.rows(), gain.name, ": got ", x.rows(), " rows, not ",
        gain.value.rows());
  cache.x_hat.resize(x.rows(), x.cols());
  cache.inv_std.resize(x.cols());
  const Real n_inv = Real(1) / static_cast<Real>(x.rows());
  for (Index j = 0; j < x.cols(); ++j) {
    const Real mean = x.col(j).sum() * n_inv;
    auto x_hat = cache.x_hat.col(j);
    x_hat = x.col(j).array() - mean;
    const Real inv_std = 1 / std::sqrt(x_hat.squaredNorm() * n_inv + kEps);
    cache.inv_std(j) = inv_std;
    x_hat *= inv_std;
    y.col(j) = gain.value.col(0).cwiseProduct(x_hat) + shift.value.col(0);
  }
}

void LayerNorm::Backward(const Cache& cache, const ConstMatRef& dy, MatRef dx) {
  AddGrad(cache, dy);
  const Real n_inv = Real(1) / static_cast<Real>(dy.rows());
  for (Index j = 0; j < dy.cols(); ++j) {
    // h = gain * dy:  dx = (h - mean(h) - x_hat mean(h x_hat)) / std; spec 3.6
    const auto x_hat = cache.x_hat.col(j).array();
    auto h = dx.col(j).array();
    h = gain.value.col(0).array() * dy.col(j).array();
    const Real mean = h.sum() * n_inv, along = (h * x_hat).sum() * n_inv;
    h = (h - mean - along * x_hat) * cache.inv_std(j);
  }
}

void LayerNorm::AddGrad(const Cache& cache, const ConstMatRef& dy) {
  auto dgain = gain.grad.col(0);
  auto dshift = shift.grad.col(0);
  for (Index j = 0; j < dy.cols(); ++j) {
    dgain += dy.col(j).cwiseProduct(cache.x_hat.col(j));
    dshift += dy.col(j);
  }
}

}  // namespace o2v
