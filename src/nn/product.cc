#include "nn/product.h"

#include "base/check.h"

namespace o2v {
namespace {

void CheckShapes(Index m, Index k, Index k2, Index n, const MatRef& C) {
  Check(k == k2 && C.rows() == m && C.cols() == n, "product: (", m, ", ", k, ") times (", k2, ", ",
        n, ") into (", C.rows(), ", ", C.cols(), ")");
}

}  // namespace

void SetAB(const ConstMatRef& A, const ConstMatRef& B, MatRef C) {
  CheckShapes(A.rows(), A.cols(), B.rows(), B.cols(), C);
  C.noalias() = A * B;
}

void AddAB(const ConstMatRef& A, const ConstMatRef& B, MatRef C) {
  CheckShapes(A.rows(), A.cols(), B.rows(), B.cols(), C);
  C.noalias() += A * B;
}

void SetABt(const ConstMatRef& A, const ConstMatRef& B, MatRef C) {
  CheckShapes(A.rows(), A.cols(), B.cols(), B.rows(), C);
  C.noalias() = A * B.transpose();
}

void AddABt(const ConstMatRef& A, const ConstMatRef& B, MatRef C) {
  CheckShapes(A.rows(), A.cols(), B.cols(), B.rows(), C);
  C.noalias() += A * B.transpose();
}

void SetAtB(const ConstMatRef& A, const ConstMatRef& B, MatRef C) {
  CheckShapes(A.cols(), A.rows(), B.rows(), B.cols(), C);
  C.noalias() = A.transpose() * B;
}

void AddAtB(const ConstMatRef& A, const ConstMatRef& B, MatRef C) {
  CheckShapes(A.cols(), A.rows(), B.rows(), B.cols(), C);
  C.noalias() += A.transpose() * B;
}

}  // namespace o2v
