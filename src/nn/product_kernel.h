#pragma once
// The loops of nn/product.h, compiled once for each instruction set of nn/isa.h.

#include "base/types.h"

namespace o2v {

/// A factor: entry (i, j) is data[i row_step + j col_step].
struct Factor {
  const Real* data;
  Index row_step, col_step;
};

/// The product, likewise; added to what is there, or put in its place.
struct Target {
  Real* data;
  Index row_step, col_step;
  bool add;
};

/// C (m, n) (+)= A (m, k) B (k, n).
using MultiplyFunction = void(const Factor& A, const Factor& B, Index m, Index k, Index n,
                              Target C);
namespace v3 {  // registers of 32 bytes (AVX2)
MultiplyFunction Multiply;
}
namespace v4 {  // registers of 64 bytes (AVX-512); the same bits
MultiplyFunction Multiply;
}

}  // namespace o2v
