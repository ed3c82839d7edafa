#include "nn/dropout.h"

#include <cmath>

#include "base/check.h"

namespace o2v {

void DrawDropoutMask(double p, Rng& rng, Mat& mask) {
  Check(p >= 0 && p < 1, "dropout: got probability ", p, ", not one in [0, 1)");
  const auto threshold = static_cast<std::uint32_t>(std::lround(p * 0x1p16));
  const Real keep = static_cast<Real>(1 / (1 - p));
  Real* out = mask.data();
  const Index n = mask.size();
  for (Index i = 0; i < n; i += 4) {
    const std::uint64_t bits = rng.Bits();
    const Index lanes = std::min<Index>(4, n - i);
    for (Index k = 0; k < lanes; ++k) {
      out[i + k] = ((bits >> (16 * k)) & 0xffff) < threshold ? Real(0) : keep;
    }
  }
}

}  // namespace o2v
