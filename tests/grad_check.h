#pragma once
// Analytic gradients beside central differences. For the double-precision library.

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "base/rng.h"
#include "base/types.h"

namespace o2v {

/// What a tensor's gradient has to be.
enum class Expect {
  kGradient,  // the numeric one; all zero is a fault
  kDetached,  // exactly zero: outside the loss or held constant in it
  kShift,     // |g| < 1e-12: the loss cannot depend on it (the key bias shifts a softmax's logits)
};

/// A tensor to check: its values, the gradient that the backward pass gave, and the loss as a
/// function of the values in place (with all that the backward pass holds constant held constant).
struct Slot {
  std::string name;
  double* value;
  VecD grad;
  std::function<double()> loss;
  Expect expect;

  template <typename M>
  Slot(std::string n, M& v, const M& g, std::function<double()> l, Expect e = Expect::kGradient)
      : name(std::move(n)), value(v.data()), grad(g.reshaped()), loss(std::move(l)), expect(e) {}
};

/// Entries of one tensor.
struct Compared {
  std::string name;
  Expect expect;
  double largest;  // max |g| over the whole tensor, also over entries that were not compared
  std::vector<double> analytic, numeric;
};
using Comparison = std::vector<Compared>;

constexpr double kStep = 1e-6;        // of the central differences; spec 10.1
constexpr double kTolerance = 1e-6;   // of the error; spec 10.2
constexpr double kReluMargin = 1e-4;  // ReLU inputs nearer to 0 are redrawn; spec 10.2

/// Compares `most` entries of each tensor, the one with the largest gradient and random others; all
/// of a tensor that has no more.
inline Comparison Compare(const std::vector<Slot>& slots, Rng& rng,
                          Index most = std::numeric_limits<Index>::max()) {
  Comparison comparison;
  for (const Slot& slot : slots) {
    const Index n = slot.grad.size();
    Index top = 0;
    const double largest = slot.grad.cwiseAbs().maxCoeff(&top);
    Compared& tensor = comparison.emplace_back(Compared{slot.name, slot.expect, largest, {}, {}});
    if (slot.expect != Expect::kGradient) continue;
    std::set<Index> entries = {top};
    for (Index i = 0; n <= most && i < n; ++i) entries.insert(i);
    while (static_cast<Index>(entries.size()) < std::min(n, most)) {
      entries.insert(static_cast<Index>(rng.UniformInt(static_cast<std::uint64_t>(n))));
    }
    for (const Index i : entries) {
      const double x = slot.value[i];
      slot.value[i] = x + kStep;
      const double above = slot.loss();
      slot.value[i] = x - kStep;
      const double below = slot.loss();
      slot.value[i] = x;
      tensor.analytic.push_back(slot.grad(i));
      tensor.numeric.push_back((above - below) / (2 * kStep));
    }
  }
  return comparison;
}

/// Adds the entries of `more` to the tensors of the same names.
inline void Merge(const Comparison& more, Comparison& comparison) {
  for (const Compared& from : more) {
    const auto to = std::find_if(comparison.begin(), comparison.end(),
                                 [&](const Compared& c) { return c.name == from.name; });
    if (to == comparison.end()) {
      comparison.push_back(from);
      continue;
    }
    to->largest = std::max(to->largest, from.largest);
    to->analytic.insert(to->analytic.end(), from.analytic.begin(), from.analytic.end());
    to->numeric.insert(to->numeric.end(), from.numeric.begin(), from.numeric.end());
  }
}

/// Outcome of a comparison.
struct Verdict {
  std::size_t entries = 0;      // compared
  double largest_gradient = 0;  // max |g| of the stage
  double largest_error = 0;     // infinite where a tensor is not what was expected of it
  std::string worst;            // the tensor with the largest error

  bool Passed() const { return largest_error < kTolerance; }
};

/// Error of an entry: |g - n| / max(|g|, |n|, 1e-3 max|g| of the stage). Source: spec 10.2.
inline Verdict RewardAndEnd(const Comparison& comparison) {
  Verdict verdict;
  for (const Compared& t : comparison) {
    verdict.largest_gradient = std::max(verdict.largest_gradient, t.largest);
  }
  const auto note = [&](double error, const std::string& name) {
    if (!(error <= verdict.largest_error)) {  // NaN counts
      verdict.largest_error = std::isnan(error) ? std::numeric_limits<double>::infinity() : error;
      verdict.worst = name;
    }
  };
  for (const Compared& t : comparison) {
    const bool fault = (t.expect == Expect::kGradient && t.largest == 0) ||
                       (t.expect == Expect::kDetached && t.largest != 0) ||
                       (t.expect == Expect::kShift && !(t.largest < 1e-12));
    if (fault) note(std::numeric_limits<double>::infinity(), t.name);
    for (std::size_t i = 0; i < t.analytic.size(); ++i) {
      const double g = t.analytic[i], n = t.numeric[i];
      const double scale = std::max({std::abs(g), std::abs(n), 1e-3 * verdict.largest_gradient});
      note(std::abs(g - n) / scale, t.name);
    }
    verdict.entries += t.analytic.size();
  }
  return verdict;
}

/// The comparison as it would be had the backward pass of one tensor been wrong by a factor.
inline Comparison WithPlantedError(Comparison comparison, std::size_t tensor, double factor) {
  comparison[tensor].largest *= factor;
  for (double& g : comparison[tensor].analytic) g *= factor;
  return comparison;
}

/// Distance of the inputs z of a ReLU from its kink.
inline double ReluMargin(const Mat& z) { return static_cast<double>(z.cwiseAbs().minCoeff()); }

}  // namespace o2v
