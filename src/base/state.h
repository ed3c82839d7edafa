#pragma once
// How a resumable object shows its state: one Visit function serves saving and loading.

#include <cstdint>
#include <string_view>
#include <vector>

#include "base/types.h"

namespace o2v {

/// Walks all state that a resumed run needs. A saving visitor copies the values out, a loading one
/// overwrites them. Names are unique within a checkpoint; callers prefix them ("worker0.").
class StateVisitor {
 public:
  virtual ~StateVisitor() = default;

  /// Networks and batches: F32 in the program. Fixed shape: a loaded shape must be equal.
  virtual void Matrix(std::string_view name, Mat& x) = 0;
  /// F64, fixed length.
  virtual void Doubles(std::string_view name, double* x, std::size_t n) = 0;
  /// I64, fixed length.
  virtual void Ints(std::string_view name, std::int64_t* x, std::size_t n) = 0;

  void Double(std::string_view name, double& x) { Doubles(name, &x, 1); }
  void Doubles(std::string_view name, VecD& x) { Doubles(name, x.data(), std::size_t(x.size())); }
  void Int(std::string_view name, std::int64_t& x) { Ints(name, &x, 1); }
  void Int(std::string_view name, int& x) {
    std::int64_t wide = x;
    Ints(name, &wide, 1);
    x = static_cast<int>(wide);
  }
  void Ints(std::string_view name, std::vector<int>& x) {
    std::vector<std::int64_t> wide(x.begin(), x.end());
    Ints(name, wide.data(), wide.size());
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<int>(wide[i]);
  }
};

}  // namespace o2v
