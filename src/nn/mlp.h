#pragma once
// Two hidden layers, the body of every network.

#include <string>
#include <vector>

#include "base/rng.h"
#include "nn/activation.h"
#include "nn/linear.h"

namespace o2v {

/// Body(n_in, h): Linear(n_in -> h), g, Linear(h -> h), g. Source: spec 2.1.
struct Body {
  Linear layer0, layer1;
  Activation g = Activation::kTanh;

  struct Cache {
    Mat h0, h1;  // (h, B) activations; h1 is the output
    Mat dh0;     // (h, B) scratch of Backward
  };

  Body() = default;
  /// `name`.0.W, `name`.0.b, `name`.1.W, `name`.1.b; orthogonal weights of gain 1, zero biases.
  Body(const std::string& name, Index n_in, Index h, Activation activation, Rng& rng);

  /// x (n_in, B) -> cache.h1 (h, B).
  void Forward(const ConstMatRef& x, Cache& cache) const;
  /// dh1 = dL/dh1 (h, B), overwritten. Adds to the gradients; inputs need no gradient anywhere.
  void Backward(const ConstMatRef& x, Cache& cache, Mat& dh1);

  std::vector<Param*> Params();
};

}  // namespace o2v
