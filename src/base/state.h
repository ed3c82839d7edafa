#pragma once
// How a resumable object shows its state: one Serialize function serves saving and loading.

#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include "base/check.h"
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
  /// The numbers that are shown next must lie in [low, high]: a visitor that loads from a file
  /// refuses others, before it changes anything.
  virtual void Within(std::int64_t /*low*/, std::int64_t /*high*/) {}

  void Double(std::string_view name, double& x) { Doubles(name, &x, 1); }
  void Doubles(std::string_view name, VecD& x) { Doubles(name, x.data(), std::size_t(x.size())); }
  void Int(std::string_view name, std::int64_t& x) { Ints(name, &x, 1); }
  void Int(std::string_view name, int& x) { Below(name, x, kMaxInt); }
  void Ints(std::string_view name, std::vector<int>& x) { AllBelow(name, x, kMaxInt); }

  /// A number of things: of steps, bytes, updates. Far below the largest, so that it can grow.
  void Count(std::string_view name, std::int64_t& x) { Counts(name, &x, 1); }
  void Counts(std::string_view name, std::int64_t* x, std::size_t n) {
    constexpr std::int64_t kMost = std::int64_t{1} << 53;
    Within(0, kMost);
    Ints(name, x, n);
  }
  /// Whole numbers in [0, bound): indices, flags. Throws Error for others.
  void Below(std::string_view name, int& x, std::int64_t bound) {
    std::vector<int> one = {x};
    AllBelow(name, one, bound);
    x = one[0];
  }
  void AllBelow(std::string_view name, std::vector<int>& x, std::int64_t bound) {
    std::vector<std::int64_t> wide(x.begin(), x.end());
    Within(0, bound - 1);
    Ints(name, wide.data(), wide.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      Check(0 <= wide[i] && wide[i] < bound, name, ": ", wide[i], " is not in [0, ", bound, ")");
      x[i] = static_cast<int>(wide[i]);
    }
  }

 private:
  static constexpr std::int64_t kMaxInt = std::numeric_limits<int>::max();
};

}  // namespace o2v
