#pragma once
// The rewards of DeepMind Control are made of this.

#include <algorithm>
#include <cmath>
#include <limits>

namespace o2v {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The interval [low, high].
struct Bounds {
  double low, high;
};

/// How Tolerance falls off outside its bounds.
enum class Sigmoid { kGaussian, kLinear, kQuadratic };

/// 1 inside the bounds, both ends included; outside, with d the distance to the nearest bound in
/// margins, falls from 1 through `value_at_margin` at d = 1: Gaussian exp(-(d s)^2 / 2),
/// s^2 = -2 ln(value_at_margin); linear 1 - (1 - value_at_margin) d and quadratic
/// 1 - (1 - value_at_margin) d^2, both at least 0. Without a margin it is 0 there.
/// Source: spec E.3.
inline double Tolerance(double x, Bounds bounds, double margin = 0,
                        Sigmoid sigmoid = Sigmoid::kGaussian, double value_at_margin = 0.1) {
  if (bounds.low <= x && x <= bounds.high) return 1;
  if (margin == 0) return 0;
  const double d = (x < bounds.low ? bounds.low - x : x - bounds.high) / margin;
  switch (sigmoid) {
    case Sigmoid::kGaussian:
      return std::exp(d * d * std::log(value_at_margin));  // = exp(-(d s)^2 / 2)
    case Sigmoid::kLinear:
      return std::max(0.0, 1 - (1 - value_at_margin) * d);
    case Sigmoid::kQuadratic:
      return std::max(0.0, 1 - (1 - value_at_margin) * d * d);
  }
  return 0;
}

}  // namespace o2v
