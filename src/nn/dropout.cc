#include "nn/dropout.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/check.h"

namespace o2v {

void DrawDropoutMask(double p, Rng& rng, Mat& mask) {
  Check(p >= 0 && p < 1, "dropout: got probability ", p, ", not one in [0, 1)");
  // u < p for u = (first, second) of 16 bits: by the first byte alone unless it equals p's.
  const auto p16 = static_cast<std::uint32_t>(std::lround(p * 0x1p16));
  if (p16 == 0x10000) {  // 1, to 2^-17
    mask.setZero();
    return;
  }
  const auto first = static_cast<std::uint8_t>(p16 >> 8), second = static_cast<std::uint8_t>(p16);
  const Real keep = static_cast<Real>(1 / (1 - p));
  Real* out = mask.data();
  constexpr Index kWords = 64, kBlock = 8 * kWords;  // small enough for the stack
  std::uint64_t words[kWords];
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(words);
  for (Index i = 0; i < mask.size(); i += kBlock) {
    const Index n = std::min(kBlock, mask.size() - i);
    const std::size_t used = static_cast<std::size_t>((n + 7) / 8);
    for (std::size_t w = 0; w < used; ++w) words[w] = rng.Bits();
    for (Index k = 0; k < n; ++k) out[i + k] = bytes[k] < first ? Real(0) : keep;
    for (Index k = 0; k < n; ++k) {
      const void* tie = std::memchr(bytes + k, first, static_cast<std::size_t>(n - k));
      if (!tie) break;
      k = static_cast<const std::uint8_t*>(tie) - bytes;
      if (static_cast<std::uint8_t>(rng.Bits()) < second) out[i + k] = 0;
    }
  }
}

}  // namespace o2v
