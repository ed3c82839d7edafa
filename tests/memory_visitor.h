#pragma once
// A StateVisitor that keeps everything in memory, for round trips.

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/check.h"
#include "base/state.h"

namespace o2v {

/// Saves on the first walk; after `load = true` it overwrites what it is shown with what it kept.
class MemoryVisitor final : public StateVisitor {
 public:
  bool load = false;

  using StateVisitor::Doubles;
  using StateVisitor::Ints;
  void Matrix(std::string_view name, Mat& x) override { Move(name, matrices_, x.data(), x.size()); }
  void Doubles(std::string_view name, double* x, std::size_t n) override {
    Move(name, doubles_, x, Index(n));
  }
  void Ints(std::string_view name, std::int64_t* x, std::size_t n) override {
    Move(name, ints_, x, Index(n));
  }

 private:
  template <typename T>
  using Kept = std::map<std::string, std::vector<T>, std::less<>>;

  template <typename T>
  void Move(std::string_view name, Kept<T>& kept, T* x, Index n) {
    const auto it = kept.find(name);
    if (!load) {
      Check(it == kept.end(), "state: two entries are called ", name);
      kept.emplace(name, std::vector<T>(x, x + n));
      return;
    }
    Check(it != kept.end() && Index(it->second.size()) == n, "state: no ", n, " entries of ", name);
    std::copy(it->second.begin(), it->second.end(), x);
  }

  Kept<Real> matrices_;
  Kept<double> doubles_;
  Kept<std::int64_t> ints_;
};

}  // namespace o2v
