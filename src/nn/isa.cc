#include "nn/isa.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>

#include "base/check.h"
#include "nn/product_kernel.h"

namespace o2v {
namespace {

/// The faster one on products of a size that most layers have.
Isa MeasureIsa() {
  using Clock = std::chrono::steady_clock;
  constexpr Index kSize = 64;
  // The first tries warm up: a core may need 20 us to open its wide registers.
  constexpr int kTries = 10;
  constexpr double kClearly = 0.8;  // of the time: less may be chance
  std::array<Real, kSize * kSize> A, B, C;
  A.fill(1);
  B.fill(1);
  const auto seconds = [&](MultiplyFunction& multiply) {
    const auto start = Clock::now();
    multiply({A.data(), 1, kSize}, {B.data(), 1, kSize}, kSize, kSize, kSize,
             {C.data(), 1, kSize, false});
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  double best_v3 = INFINITY, best_v4 = INFINITY;
  for (int i = 0; i < kTries; ++i) {
    best_v3 = std::min(best_v3, seconds(v3::Multiply));
    best_v4 = std::min(best_v4, seconds(v4::Multiply));
  }
  return best_v4 < kClearly * best_v3 ? Isa::kV4 : Isa::kV3;
}

}  // namespace

std::string ToString(Isa isa) { return isa == Isa::kV4 ? "v4" : "v3"; }

bool HasV4() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512vl");
}

std::optional<Isa> ReadIsa(const char* value, bool has_v4) {
  if (!value) return std::nullopt;
  const std::string isa = value;
  if (isa == "v3") return Isa::kV3;
  if (isa != "v4") throw ConfigError(Concat("O2V_ISA: expected v3 or v4, got '", isa, "'"));
  if (!has_v4) throw ConfigError("O2V_ISA: v4, but this processor has no AVX-512");
  return Isa::kV4;
}

Isa ChosenIsa() {
  static const Isa isa = [] {
    const bool has_v4 = HasV4();
    if (const auto asked = ReadIsa(std::getenv("O2V_ISA"), has_v4)) return *asked;
    return has_v4 ? MeasureIsa() : Isa::kV3;
  }();
  return isa;
}

}  // namespace o2v
