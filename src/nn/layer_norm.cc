#include "nn/layer_norm.h"

#include <cmath>

#include "base/check.h"
#include "nn/lanes.h"

namespace o2v {
namespace {

constexpr Real kEps = Real(1e-5);  // spec 2.1

}  // namespace

void LayerNorm::Forward(const ConstMatRef& x, Cache& cache, MatRef y) const {
  Check(x.rows() == gain.value.rows(), gain.name, ": got ", x.rows(), " rows, not ",
        gain.value.rows());
  Check(y.rows() == x.rows() && y.cols() == x.cols(), gain.name, ": got y (", y.rows(), ", ",
        y.cols(), ") for x (", x.rows(), ", ", x.cols(), ")");
  const Index n = x.rows(), B = x.cols();
  cache.x_hat.resize(n, B);
  cache.inv_std.resize(B);
  const Real n_inv = Real(1) / static_cast<Real>(n);
  const Real* g = gain.value.data();
  const Real* b = shift.value.data();
  // In passes: a column at one go would wait for its root and quotient. Meanwhile inv_std holds the
  // sum of squares.
  for (Index j = 0; j < B; ++j) {
    const Real* xj = x.data() + j * x.outerStride();
    Real* x_hat = cache.x_hat.data() + j * n;
    LaneSum sum, squares;
    ForLanes(n, [&](auto kN, Index i) { sum.Add(At<kN>(xj + i)); });
    const Real mean = sum.Total() * n_inv;
    ForLanes(n, [&](auto kN, Index i) {
      const Lanes<kN> centred = At<kN>(xj + i) - mean;
      squares.Add(centred.square());
      At<kN>(x_hat + i) = centred;
    });
    cache.inv_std(j) = squares.Total();
  }
  for (Real& squares : cache.inv_std) squares = 1 / std::sqrt(squares * n_inv + kEps);
  for (Index j = 0; j < B; ++j) {
    Real* yj = y.data() + j * y.outerStride();
    Real* x_hat = cache.x_hat.data() + j * n;
    const Real inv_std = cache.inv_std(j);
    ForLanes(n, [&](auto kN, Index i) {
      const Lanes<kN> normal = At<kN>(x_hat + i) * inv_std;
      At<kN>(x_hat + i) = normal;
      At<kN>(yj + i) = At<kN>(g + i) * normal + At<kN>(b + i);
    });
  }
}

void LayerNorm::Backward(const Cache& cache, const ConstMatRef& dy, MatRef dx) {
  AddGrad(cache, dy);
  Check(dx.rows() == dy.rows() && dx.cols() == dy.cols(), gain.name, ": got dx (", dx.rows(), ", ",
        dx.cols(), ") for dy (", dy.rows(), ", ", dy.cols(), ")");
  const Index n = dy.rows();
  const Real n_inv = Real(1) / static_cast<Real>(n);
  const Real* g = gain.value.data();
  for (Index j = 0; j < dy.cols(); ++j) {
    // h = gain * dy:  dx = (h - mean(h) - x_hat mean(h x_hat)) / std; spec 3.6
    const Real* dyj = dy.data() + j * dy.outerStride();
    const Real* x_hat = cache.x_hat.data() + j * n;
    Real* h = dx.data() + j * dx.outerStride();
    LaneSum sum, dot;
    ForLanes(n, [&](auto kN, Index i) {
      const Lanes<kN> hi = At<kN>(g + i) * At<kN>(dyj + i);
      sum.Add(hi);
      dot.Add(hi * At<kN>(x_hat + i));
      At<kN>(h + i) = hi;
    });
    const Real mean = sum.Total() * n_inv, along = dot.Total() * n_inv;
    const Real inv_std = cache.inv_std(j);
    ForLanes(n, [&](auto kN, Index i) {
      At<kN>(h + i) = (At<kN>(h + i) - mean - along * At<kN>(x_hat + i)) * inv_std;
    });
  }
}

void LayerNorm::AddGrad(const Cache& cache, const ConstMatRef& dy) {
  Check(dy.rows() == cache.x_hat.rows() && dy.cols() <= cache.x_hat.cols(), gain.name, ": got dy (",
        dy.rows(), ", ", dy.cols(), ") for x (", cache.x_hat.rows(), ", ", cache.x_hat.cols(), ")");
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
