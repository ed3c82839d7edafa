#pragma once
// Initial values of weights.

#include "base/rng.h"
#include "base/types.h"

namespace o2v {

/// Gain of output layers, of mu and sigma too. Source: spec 2.1, 2.6 item 7.
inline constexpr double kHeadGain = 1e-3;

/// gain x the Q factor of a Gaussian matrix, signs fixed by R's diagonal: rows orthonormal when
/// rows <= cols, else columns. Source: spec 2.1 (Saxe et al. 2014).
void Orthogonal(Mat& W, double gain, Rng& rng);

/// U(-a, a), a = sqrt(6 / (fan_in + fan_out)). Source: spec 2.1 (Glorot & Bengio 2010).
void XavierUniform(Mat& W, Index fan_in, Index fan_out, Rng& rng);
/// The same with the fans of W (n_out, n_in) itself.
void XavierUniform(Mat& W, Rng& rng);

/// U(-a, a).
void Uniform(Mat& W, double a, Rng& rng);

/// Gives the weights of a new network their initial values, drawn from a random stream. Without one
/// they stay zero: of a network that is only to be counted. Drawing is nearly all that making a
/// network costs.
class Initialiser {
 public:
  Initialiser() = default;
  /// Draws from `rng`, which is kept. Implicit: a stream is all that a network's maker has.
  Initialiser(Rng& rng) : rng_(&rng) {}  // NOLINT(google-explicit-constructor)

  void Orthogonal(Mat& W, double gain) const;
  void XavierUniform(Mat& W) const;
  void XavierUniform(Mat& W, Index fan_in, Index fan_out) const;
  void Uniform(Mat& W, double a) const;

 private:
  Rng* rng_ = nullptr;
};

}  // namespace o2v
