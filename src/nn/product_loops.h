// Eigen's own product copies both factors into panels, for matrices far beyond the caches. Ours fit
// into the first ones, and many are but a few rows or columns thin (K options, A actions): copying
// would cost more than multiplying. Here a strip of A, a few registers high, passes over all of B;
// it is copied where its rows lie apart or fill no register. Speed hangs on how the compiler
// inlines what follows: after a change look at all of BM_Product.
//
// An entry of C is, a block of kDepth, one sum over k in rising order, and the blocks are added in
// order: whatever its place, the width of the batch and of the registers, or the size of the
// machine's caches.
//
// Included by product_v3.cc and product_v4.cc, which set O2V_ISA (a namespace) and O2V_REGISTER
// [bytes].

#include <algorithm>

#include "nn/lanes.h"
#include "nn/product_kernel.h"

namespace o2v::O2V_ISA {
namespace {

constexpr int kLanes = O2V_REGISTER / sizeof(Real);
constexpr Index kDepth = 128;  // a strip of two registers: 8 or 16 kB of the first cache's 32

Factor From(const Factor& A, Index i, Index j) {
  return {A.data + i * A.row_step + j * A.col_step, A.row_step, A.col_step};
}
Target From(const Target& C, Index i, Index j) {
  return {C.data + i * C.row_step + j * C.col_step, C.row_step, C.col_step, C.add};
}
Factor Transposed(const Factor& A) { return {A.data, A.col_step, A.row_step}; }

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
    B = From(B, 0, kCols);
    C = From(C, 0, kCols);
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
  alignas(O2V_REGISTER) Real copy[kHeight * kDepth];
  if (A.col_step == 1 && rows == kHeight) {
    using Stride = Eigen::OuterStride<>;
    Index q = 0;
    if constexpr (kN == kLanes) {  // squares are transposed in registers
      using Square = Eigen::Matrix<Real, kN, kN>;
      for (; q + kN <= k; q += kN) {
        for (Index i = 0; i < kHeight; i += kN) {
          Square square =
              Eigen::Map<const Square, 0, Stride>(From(A, i, q).data, Stride(A.row_step));
          square.transposeInPlace();
          Eigen::Map<Square, 0, Stride>(copy + q * kHeight + i, Stride(kHeight)) = square;
        }
      }
    }
    using Columns = Eigen::Matrix<Real, Eigen::Dynamic, kHeight>;
    const Eigen::Map<const Columns, 0, Stride> from(From(A, 0, q).data, k - q, kHeight,
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

}  // namespace

void Multiply(const Factor& A, const Factor& B, Index m, Index k, Index n, Target C) {
  // C^T = B^T A^T where neither needs a copy and A is thin, or where both do and B is the smaller.
  const bool copy_A = A.row_step != 1, copy_B = B.col_step != 1;
  if (copy_B ? copy_A && n < m : !copy_A && m <= kLanes && m < n) {
    Multiply(Transposed(B), Transposed(A), n, k, m, {C.data, C.col_step, C.row_step, C.add});
    return;
  }
  for (Index q = 0; q == 0 || q < k; q += kDepth, C.add = true) {
    const Index depth = std::min(kDepth, k - q);
    for (Index i = 0; i < m;) {
      const Factor a = From(A, i, q), b = From(B, q, 0);
      const Target c = From(C, i, 0);
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

}  // namespace o2v::O2V_ISA
