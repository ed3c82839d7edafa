#pragma once
// Random numbers: one named stream per purpose, portable sequences.

#include <cstdint>
#include <random>
#include <string>
#include <string_view>

#include "base/state.h"

namespace o2v {

/// std::mt19937_64 (its sequence is fixed by the standard) with our own distributions: the standard
/// library's are not portable and hide state. Streams are derived from (seed, name), so that
/// drawing more in one place shifts nothing elsewhere.
class Rng {
 public:
  Rng(std::uint64_t seed, std::string_view stream);

  /// 64 raw bits.
  std::uint64_t Bits() { return engine_(); }
  /// Uniform in [0, 1), 53 bits. Always double: as float the largest value would round to 1.
  double Uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  /// Uniform in [low, high).
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  /// Standard normal (Box-Muller, cosine branch only: the engine is the whole state).
  double Normal();
  /// Uniform in {0, ..., n-1}; n > 0. Lemire's multiply-shift with rejection: unbiased.
  std::uint64_t UniformInt(std::uint64_t n);

  /// The engine's 312 words and position under `name`.
  void Serialize(StateVisitor& v, std::string_view name);

 private:
  std::mt19937_64 engine_;
};

}  // namespace o2v
