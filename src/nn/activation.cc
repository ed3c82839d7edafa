#include "nn/activation.h"

namespace o2v {
namespace {

constexpr double kSoftplusLinear = 20;  // spec 2.1

}  // namespace

void BiasActivate(Activation g, const Mat& b, MatRef y) {
  switch (g) {
    case Activation::kTanh:
      for (Index j = 0; j < y.cols(); ++j) y.col(j) = (y.col(j) + b.col(0)).array().tanh();
      break;
    case Activation::kRelu:
      for (Index j = 0; j < y.cols(); ++j) y.col(j) = (y.col(j) + b.col(0)).cwiseMax(0);
      break;
  }
}

void ActivationBackward(Activation g, const ConstMatRef& y, MatRef dy) {
  switch (g) {
    case Activation::kTanh:
      dy.array() *= 1 - y.array().square();
      break;
    case Activation::kRelu:
      for (Index j = 0; j < y.cols(); ++j) {  // a plain loop vectorises, Eigen's select does not
        const Real* yj = y.data() + j * y.outerStride();
        Real* dyj = dy.data() + j * dy.outerStride();
        for (Index i = 0; i < y.rows(); ++i) dyj[i] = yj[i] > 0 ? dyj[i] : 0;
      }
      break;
  }
}

void Softplus(MatRef y) {
  // max(x, 0) + ln(1 + e^{-|x|}) does not overflow.
  const auto smooth = y.array().max(0) + (-y.array().abs()).exp().log1p();
  if (y.maxCoeff() <= Real(kSoftplusLinear)) {
    y.array() = smooth;
  } else {
    y.array() = (y.array() > Real(kSoftplusLinear)).select(y.array(), smooth);
  }
}

void SoftplusBackward(const ConstMatRef& y, MatRef dy) { dy.array() *= -(-y.array()).expm1(); }

void Sigmoid(MatRef y) {
  // e^{-|x|} does not overflow: sigmoid(x) = 1 / (1 + e^{-x}) = e^x / (1 + e^x).
  y.array() =
      (y.array() > 0).select(Real(1), y.array().min(0).exp()) / (1 + (-y.array().abs()).exp());
}

void SigmoidBackward(const ConstMatRef& y, MatRef dy) { dy.array() *= y.array() * (1 - y.array()); }

}  // namespace o2v
