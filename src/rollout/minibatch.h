#pragma once
// Shuffled minibatches.

#include <algorithm>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "base/rng.h"

namespace o2v {

/// Calls use(rows) for consecutive blocks of `size` of a fresh uniform permutation of 0..n-1, n =
/// order.size(); a last smaller block is used as well. Source: spec 1.4 (Fisher-Yates shuffle).
template <typename Use>
void ForEachMinibatch(std::vector<int>& order, int size, Rng& rng, Use&& use) {
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[rng.UniformInt(i)]);
  const std::size_t block = static_cast<std::size_t>(size);
  for (std::size_t start = 0; start < order.size(); start += block) {
    use(std::span<const int>(order).subspan(start, std::min(block, order.size() - start)));
  }
}

}  // namespace o2v
