#include "nn/embedding.h"

#include "base/check.h"
#include "nn/product.h"

namespace o2v {

void GatherColumns(const Mat& E, std::span<const int> o, MatRef out) {
  Check(out.rows() == E.rows() && out.cols() == Index(o.size()), "embedding: got output (",
        out.rows(), ", ", out.cols(), "), not (", E.rows(), ", ", o.size(), ")");
  for (std::size_t b = 0; b < o.size(); ++b) out.col(Index(b)) = E.col(o[b]);
}

void ScatterColumns(const ConstMatRef& d, std::span<const int> o, Mat& dE) {
  for (std::size_t b = 0; b < o.size(); ++b) dE.col(o[b]) += d.col(Index(b));
}

void EmbeddedLinear::MakeTable(const Mat& E, Mat& table) const {
  table.resize(W.value.rows(), E.cols());
  SetAB(W.value.rightCols(W.value.cols() - n_x_), E, table);
  table.colwise() += b.value.col(0);
}

void EmbeddedLinear::MultiplyState(const ConstMatRef& x, MatRef y) const {
  Check(x.rows() == n_x_, W.name, ": got ", x.rows(), " rows, not ", n_x_);
  SetAB(W.value.leftCols(n_x_), x, y);
}

void EmbeddedLinear::AddStateGrad(const ConstMatRef& x, const ConstMatRef& dy) {
  AddABt(dy, x, W.grad.leftCols(n_x_));
}

void EmbeddedLinear::AddTableGrad(const Mat& E, const Mat& dtable, Mat* dE) {
  const Index D = W.value.cols() - n_x_;
  AddABt(dtable, E, W.grad.rightCols(D));
  b.grad.col(0) += dtable.rowwise().sum();
  if (dE) AddAtB(W.value.rightCols(D), dtable, *dE);
}

}  // namespace o2v
