#include "nn/linear.h"

#include "base/check.h"
#include "nn/product.h"

namespace o2v {

void Linear::CheckInput(const ConstMatRef& x) const {
  Check(x.rows() == W.value.cols(), W.name, ": got x (", x.rows(), ", ", x.cols(), ") for W (",
        W.value.rows(), ", ", W.value.cols(), ")");
}

void Linear::Forward(const ConstMatRef& x, MatRef y) const {
  CheckInput(x);
  y.colwise() = b.value.col(0);
  AddAB(W.value, x, y);
}

void Linear::Multiply(const ConstMatRef& x, MatRef y) const {
  CheckInput(x);
  SetAB(W.value, x, y);
}

void Linear::AddGrad(const ConstMatRef& x, const ConstMatRef& dy) {
  AddABt(dy, x, W.grad);
  b.grad.col(0) += dy.rowwise().sum();
}

void Linear::BackwardInput(const ConstMatRef& dy, MatRef dx) const { SetAtB(W.value, dy, dx); }

}  // namespace o2v
