#pragma once
// Layer normalisation.

#include <string>
#include <vector>

#include "nn/param.h"

namespace o2v {

/// y = gain * x_hat + shift, x_hat = (x - mean) / sqrt(var + 1e-5), per column, population
/// variance. Source: spec 2.1, 3.6 (Ba et al. 2016).
struct LayerNorm {
  Param gain;   // (n, 1), ones at start
  Param shift;  // (n, 1), zeros at start

  /// What Backward needs of Forward.
  struct Cache {
    Mat x_hat;    // (n, B)
    Vec inv_std;  // (B)
  };

  LayerNorm() = default;
  LayerNorm(const std::string& name, Index n)
      : gain(name + ".gain", n, 1), shift(name + ".shift", n, 1) {
    gain.value.setOnes();
  }

  /// x (n, B) -> y (n, B), which may be x itself.
  void Forward(const ConstMatRef& x, Cache& cache, MatRef y) const;
  /// dy (n, B) -> dx (n, B), which may be dy itself. Adds to the gradients.
  void Backward(const Cache& cache, const ConstMatRef& dy, MatRef dx);
  /// The same without dx.
  void AddGrad(const Cache& cache, const ConstMatRef& dy);

  std::vector<Param*> Params() { return {&gain, &shift}; }
};

}  // namespace o2v
