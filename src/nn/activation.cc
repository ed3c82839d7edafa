#include "nn/activation.h"

#include <algorithm>

#include "base/check.h"

namespace o2v {
namespace {

constexpr double kSoftplusLinear = 20;  // spec 2.1

using Row = Eigen::Array<Real, Eigen::Dynamic, 1>;

/// All entries in one row: a matrix with fewer rows than a vector register has lanes (an action has
/// 1 to 17 entries) would otherwise be walked number by number.
Eigen::Map<Row> Flat(MatRef& y) {
  Check(y.outerStride() == y.rows(), "activation: columns of ", y.rows(), " rows lie ",
        y.outerStride(), " apart");
  return {y.data(), y.size()};
}
Eigen::Map<const Row> Flat(const ConstMatRef& y) {
  Check(y.outerStride() == y.rows(), "activation: columns of ", y.rows(), " rows lie ",
        y.outerStride(), " apart");
  return {y.data(), y.size()};
}

}  // namespace

void BiasActivate(Activation g, const Mat& b, MatRef y) {
  const Index n = y.rows();
  const Real* bias = b.data();
  const bool relu = g == Activation::kRelu;
  for (Index j = 0; j < y.cols(); ++j) {  // plain loops vectorise without Eigen's block overhead
    Real* yj = y.data() + j * y.outerStride();
    if (relu) {
      for (Index i = 0; i < n; ++i) yj[i] = std::max(yj[i] + bias[i], Real(0));
    } else {
      for (Index i = 0; i < n; ++i) yj[i] += bias[i];
    }
  }
  if (!relu) Tanh(y);
}

void Tanh(MatRef y) { Flat(y) = Flat(y).tanh(); }

void ActivationBackward(Activation g, const ConstMatRef& y, MatRef dy) {
  const auto out = Flat(y);
  auto d = Flat(dy);
  switch (g) {
    case Activation::kTanh:
      d *= 1 - out.square();
      break;
    case Activation::kRelu:
      for (Index i = 0; i < d.size(); ++i) d[i] = out[i] > 0 ? d[i] : 0;
      break;
  }
}

void Softplus(MatRef y) {
  if (y.size() == 0) return;  // none is the largest
  auto x = Flat(y);
  // max(x, 0) + ln(1 + e^{-|x|}) does not overflow.
  const auto smooth = x.max(0) + (-x.abs()).exp().log1p();
  if (x.maxCoeff() <= Real(kSoftplusLinear)) {
    x = smooth;
  } else {
    x = (x > Real(kSoftplusLinear)).select(x, smooth);
  }
}

void SoftplusBackward(const ConstMatRef& y, MatRef dy) { Flat(dy) *= -(-Flat(y)).expm1(); }

void Sigmoid(MatRef y) {
  // e^{-|x|} does not overflow: sigmoid(x) = 1 / (1 + e^{-x}) = e^x / (1 + e^x).
  auto x = Flat(y);
  x = (x > 0).select(Real(1), x.min(0).exp()) / (1 + (-x.abs()).exp());
}

void SigmoidBackward(const ConstMatRef& y, MatRef dy) { Flat(dy) *= Flat(y) * (1 - Flat(y)); }

}  // namespace o2v
