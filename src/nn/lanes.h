#pragma once
// Numbers of a vector register, and loops with them over short columns: one has D = 20 to 40
// entries, so that block expressions of run-time size would cost more than the arithmetic.

#include <type_traits>

#include "base/types.h"

namespace o2v {

/// kN numbers that are worked on at once.
template <int kN>
using Lanes = Eigen::Array<Real, kN, 1>;

template <int kN>
Eigen::Map<Lanes<kN>> At(Real* x) {
  return Eigen::Map<Lanes<kN>>(x);
}
template <int kN>
Eigen::Map<const Lanes<kN>> At(const Real* x) {
  return Eigen::Map<const Lanes<kN>>(x);
}

/// Calls f(kN, i), kN a constant, for pieces [i, i + kN) that make up [0, n): of 8, then at most
/// one each of 4, 2 and 1.
template <typename F>
void ForLanes(Index n, F&& f) {
  Index i = 0;
  for (; i + 8 <= n; i += 8) f(std::integral_constant<int, 8>(), i);
  if (n & 4) {
    f(std::integral_constant<int, 4>(), i);
    i += 4;
  }
  if (n & 2) {
    f(std::integral_constant<int, 2>(), i);
    i += 2;
  }
  if (n & 1) f(std::integral_constant<int, 1>(), i);
}

/// A sum over the pieces of ForLanes.
struct LaneSum {
  Lanes<8> eights = Lanes<8>::Zero();
  Lanes<4> four = Lanes<4>::Zero();
  Real rest = 0;

  template <typename Piece>
  void Add(const Piece& x) {
    if constexpr (Piece::SizeAtCompileTime == 8) {
      eights += x;
    } else if constexpr (Piece::SizeAtCompileTime == 4) {
      four += x;
    } else {
      rest += x.sum();
    }
  }
  Real Total() const { return (eights.head<4>() + eights.tail<4>() + four).sum() + rest; }
};

}  // namespace o2v
