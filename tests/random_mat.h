#pragma once
// Random matrices for tests.

#include "base/rng.h"
#include "base/types.h"

namespace o2v {

/// (rows, cols) standard normal entries, times `scale`.
inline Mat RandomMat(Index rows, Index cols, Rng& rng, double scale = 1) {
  Mat x(rows, cols);
  for (Index i = 0; i < x.size(); ++i) x.data()[i] = static_cast<Real>(scale * rng.Normal());
  return x;
}

/// n options in {0, ..., K-1}.
inline std::vector<int> RandomOptions(std::size_t n, int K, Rng& rng) {
  std::vector<int> o(n);
  for (int& k : o) k = static_cast<int>(rng.UniformInt(static_cast<std::uint64_t>(K)));
  return o;
}

}  // namespace o2v
