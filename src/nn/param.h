#pragma once
// Trainable arrays.

#include <string>
#include <vector>

#include "base/types.h"

namespace o2v {

/// One trainable array; every Backward adds to grad, which the optimiser consumes.
struct Param {
  std::string name;
  Mat value, grad;

  Param() = default;
  /// Zero-filled (rows, cols).
  Param(std::string n, Index rows, Index cols)
      : name(std::move(n)), value(Mat::Zero(rows, cols)), grad(Mat::Zero(rows, cols)) {}
};

/// Appends a module's parameters to a list.
inline void Append(std::vector<Param*>& list, const std::vector<Param*>& more) {
  list.insert(list.end(), more.begin(), more.end());
}

/// Entries of all arrays together.
inline Index CountParams(const std::vector<Param*>& params) {
  Index n = 0;
  for (const Param* p : params) n += p->value.size();
  return n;
}

inline void ZeroGrad(const std::vector<Param*>& params) {
  for (Param* p : params) p->grad.setZero();
}

}  // namespace o2v
