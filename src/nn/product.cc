#include "nn/product.h"

#include "base/check.h"
#include "nn/isa.h"
#include "nn/product_kernel.h"

namespace o2v {
namespace {

constexpr Index kThin = 8;  // rows or columns

/// A matrix (rows, cols) or its transpose.
struct Operand {
  Factor entries;
  Index rows, cols;
};
Operand Plain(const ConstMatRef& X) { return {{X.data(), 1, X.outerStride()}, X.rows(), X.cols()}; }
Operand Transposed(const ConstMatRef& X) {
  return {{X.data(), X.outerStride(), 1}, X.cols(), X.rows()};
}

/// C (+)= A B.
void Product(const Operand& A, const Operand& B, MatRef& C, bool add) {
  Check(A.cols == B.rows && C.rows() == A.rows && C.cols() == B.cols, "product: (", A.rows, ", ",
        A.cols, ") times (", B.rows, ", ", B.cols, ") into (", C.rows(), ", ", C.cols(), ")");
  static const bool wide = ChosenIsa() == Isa::kV4;
  // Thin ones leave most of a wide register idle.
  MultiplyFunction& multiply =
      wide && A.rows > kThin && B.cols > kThin ? v4::Multiply : v3::Multiply;
  multiply(A.entries, B.entries, A.rows, A.cols, B.cols, {C.data(), 1, C.outerStride(), add});
}

}  // namespace

void SetAB(const ConstMatRef& A, const ConstMatRef& B, MatRef C) {
  Product(Plain(A), Plain(B), C, false);
}
void AddAB(const ConstMatRef& A, const ConstMatRef& B, MatRef C) {
  Product(Plain(A), Plain(B), C, true);
}
void SetABt(const ConstMatRef& A, const ConstMatRef& B, MatRef C) {
  Product(Plain(A), Transposed(B), C, false);
}
void AddABt(const ConstMatRef& A, const ConstMatRef& B, MatRef C) {
  Product(Plain(A), Transposed(B), C, true);
}
void SetAtB(const ConstMatRef& A, const ConstMatRef& B, MatRef C) {
  Product(Transposed(A), Plain(B), C, false);
}
void AddAtB(const ConstMatRef& A, const ConstMatRef& B, MatRef C) {
  Product(Transposed(A), Plain(B), C, true);
}

}  // namespace o2v
