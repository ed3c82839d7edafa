#include "nn/product.h"

#include <algorithm>

#include "base/check.h"
#include "nn/lanes.h"

// Eigen's own product copies both factors into panels, for matrices far beyond the caches. Ours fit
// into the first ones, and many are but a few rows or columns thin (K options, A actions): copying
// would cost more than multiplying. Here a strip of A, a few registers high, passes over all of B;
// it is copied where its rows lie apart or fill no register. Speed hangs on how the compiler
// inlines what follows: after a change look at all of BM_Product.
//
// An entry of C is, a block of kDepth, one sum over k in rising order, and the blocks are added in
// order: whatever its place, the width of the batch or the size of the machine's caches.

namespace o2v {
namespace {

constexpr int kLanes = 32 / sizeof(Real);  // of an AVX2 register
constexpr Index kDepth = 128;              // 16 floats high: 8 kB of the first cache's 32

/// A factor: entry (i, j) is data[i row_step + j col_step].
struct Factor {
  const Real* data;
  Index row_step, col_step;

  Factor From(Index i, Index j) const {
    return {data + i * row_step + j * col_step, row_step, col_step};
  }
  Factor Transposed() const { return {data, col_step, row_step}; }
};

/// The product, likewise; added to what is there, or put in its place.
struct Target {
  Real* data;
  Index row_step, col_step;
  bool add;

  Target From(Index i, Index j) const {
    return {data + i * row_step + j * col_step, row_step, col_step, add};
  }
};

/// Rows of A whose entries lie together, the columns `col_step` apart: (kN kRegs, k).
struct Strip {
  const Real* data;
  Index col_step;
};

/// C (rows, kCols) (+)= strip B (k, kCols), of the strip's first `rows` rows. The sums stay in
/// registers.
template <int kN, int kRegs, int kCols>
void MultiplyTile(Strip strip, const Factor& B, Index rows, Index k, const Target& C) {
  constexpr Index kHeight = kN * kRegs;
  Lanes<kN> sum[kCols][kRegs];
  for (int j = 0; j < kCols; ++j) {
    for (int r = 0; r < kRegs; ++r) sum[j][r].setZero();
  }
  for (Index q = 0; q < k; ++q, strip.data += strip.col_step) {
    Lanes<kN> a[kRegs];
    for (int r = 0; r < kRegs; ++r) a[r] = At<kN>(strip.data + r * kN);
    for (int j = 0; j < kCols; ++j) {
      const Real b = B.data[q * B.row_step + j * B.col_step];
      for (int r = 0; r < kRegs; ++r) sum[j][r] += a[r] * b;
    }
  }
  if (rows == kHeight && C.row_step == 1) {
    for (int j = 0; j < kCols; ++j) {
      for (int r = 0; r < kRegs; ++r) {
        auto c = At<kN>(C.data + j * C.col_step + r * kN);
        c = C.add ? Lanes<kN>(c + sum[j][r]) : sum[j][r];
      }
    }
    return;
  }
  Real out[kCols * kHeight];
  for (int j = 0; j < kCols; ++j) {
    for (int r = 0; r < kRegs; ++r) At<kN>(out + j * kHeight + r * kN) = sum[j][r];
  }
  for (int j = 0; j < kCols; ++j) {
    for (Index i = 0; i < rows; ++i) {
      Real& c = C.data[i * C.row_step + j * C.col_step];
      c = C.add ? c + out[j * kHeight + i] : out[j * kHeight + i];
    }
  }
}

/// C (rows, n) (+)= strip B (k, n), kCols columns at once and what is left by fewer.
template <int kN, int kRegs, int kCols>
void MultiplyColumns(Strip strip, Factor B, Index rows, Index k, Index n, Target C) {
  for (; n >= kCols; n -= kCols) {
    MultiplyTile<kN, kRegs, kCols>(strip, B, rows, k, C);
    B = B.From(0, kCols);
    C = C.From(0, kCols);
  }
  if constexpr (kCols > 1) {
    MultiplyColumns<kN, kRegs, (kCols > 4 ? 4 : kCols / 2)>(strip, B, rows, k, n, C);
  }
}

/// C (rows, n) (+)= A (rows, k) B (k, n), rows at most kN kRegs and k at most kDepth.
template <int kN, int kRegs, int kCols>
void MultiplyStrip(const Factor& A, const Factor& B, Index rows, Index k, Index n,
                   const Target& C) {
  constexpr Index kHeight = kN * kRegs;
  // Half registers are copied always: with known steps in the strip the steps in B fit in
  // registers.
  if (kN == kLanes && A.row_step == 1 && rows == kHeight) {
    MultiplyColumns<kN, kRegs, kCols>({A.data, A.col_step}, B, rows, k, n, C);
    return;
  }
  alignas(32) Real copy[kHeight * kDepth];
  if (A.col_step == 1 && rows == kHeight) {
    using Stride = Eigen::OuterStride<>;
    Index q = 0;
    if constexpr (kN == kLanes) {  // squares are transposed in registers
      using Square = Eigen::Matrix<Real, kN, kN>;
      for (; q + kN <= k; q += kN) {
        for (Index i = 0; i < kHeight; i += kN) {
          Square square =
              Eigen::Map<const Square, 0, Stride>(A.From(i, q).data, Stride(A.row_step));
          square.transposeInPlace();
          Eigen::Map<Square, 0, Stride>(copy + q * kHeight + i, Stride(kHeight)) = square;
        }
      }
    }
    using Columns = Eigen::Matrix<Real, Eigen::Dynamic, kHeight>;
    const Eigen::Map<const Columns, 0, Stride> from(A.From(0, q).data, k - q, kHeight,
                                                    {A.row_step});
    Eigen::Map<Eigen::Matrix<Real, kHeight, Eigen::Dynamic>>(copy + q * kHeight, kHeight, k - q) =
        from.transpose();
  } else {
    for (Index q = 0; q < k; ++q) {
      for (Index i = 0; i < kHeight; ++i) {
        copy[q * kHeight + i] = i < rows ? A.data[i * A.row_step + q * A.col_step] : Real(0);
      }
    }
  }
  MultiplyColumns<kN, kRegs, kCols>({copy, kHeight}, B, rows, k, n, C);
}

/// C (m, n) (+)= A (m, k) B (k, n).
void Multiply(const Factor& A, const Factor& B, Index m, Index k, Index n, Target C) {
  // C^T = B^T A^T where neither needs a copy and A is thin, or where both do and B is the smaller.
  const bool copy_A = A.row_step != 1, copy_B = B.col_step != 1;
  if (copy_B ? copy_A && n < m : !copy_A && m <= kLanes && m < n) {
    Multiply(B.Transposed(), A.Transposed(), n, k, m, {C.data, C.col_step, C.row_step, C.add});
    return;
  }
  for (Index q = 0; q == 0 || q < k; q += kDepth, C.add = true) {
    const Index depth = std::min(kDepth, k - q);
    for (Index i = 0; i < m;) {
      const Factor a = A.From(i, q), b = B.From(q, 0);
      const Target c = C.From(i, 0);
      // 12 or 8 sums at once: enough to hide an addition's latency, no more than there are
      // registers.
      if (n == 1 && m - i >= 8 * kLanes) {
        MultiplyStrip<kLanes, 8, 1>(a, b, 8 * kLanes, depth, n, c);
        i += 8 * kLanes;
      } else if (m - i >= 2 * kLanes) {
        MultiplyStrip<kLanes, 2, 6>(a, b, 2 * kLanes, depth, n, c);
        i += 2 * kLanes;
      } else if (m - i > kLanes / 2) {
        MultiplyStrip<kLanes, 1, 8>(a, b, std::min<Index>(m - i, kLanes), depth, n, c);
        i += kLanes;
      } else {
        MultiplyStrip<kLanes / 2, 1, 8>(a, b, m - i, depth, n, c);
        i += kLanes / 2;
      }
    }
  }
}

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
  Multiply(A.entries, B.entries, A.rows, A.cols, B.cols, {C.data(), 1, C.outerStride(), add});
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
