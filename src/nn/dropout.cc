#include "nn/dropout.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/check.h"

namespace o2v {

void DrawDropoutMask(double p, Rng& rng, Mat& mask) {
  Check(p >= 0 && p < 1, "dropout: got probability ", p, ", not one in [0, 1)");
  const auto threshold = static_cast<std::int32_t>(std::lround(p * 0x1p16));
  const Real keep = static_cast<Real>(1 / (1 - p));
  Real* out = mask.data();
  constexpr Index kWords = 64, kLanes = 4 * kWords;  // a block small enough for the stack
  std::uint64_t words[kWords];
  std::uint16_t lanes[kLanes];
  for (Index i = 0; i < mask.size(); i += kLanes) {
    const Index n = std::min(kLanes, mask.size() - i);
    const std::size_t used = static_cast<std::size_t>((n + 3) / 4);
    for (std::size_t w = 0; w < used; ++w) words[w] = rng.Bits();
    std::memcpy(lanes, words, used * sizeof words[0]);
    for (Index k = 0; k < n; ++k) out[i + k] = lanes[k] < threshold ? Real(0) : keep;
  }
}

}  // namespace o2v
