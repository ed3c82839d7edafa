#pragma once
// Dropout with a kept mask.

#include "base/rng.h"
#include "base/types.h"

namespace o2v {

/// Fills mask with 0 (probability p) or 1 / (1 - p), independently. Multiplying by the mask is both
/// the forward and the backward pass. p is met to 2^-17 at little more than one random byte an
/// entry: a second byte is drawn only where the first does not decide.
void DrawDropoutMask(double p, Rng& rng, Mat& mask);

}  // namespace o2v
