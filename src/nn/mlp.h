#pragma once
// Two hidden layers, the body of every network.

#include <string>
#include <vector>

#include "nn/activation.h"
#include "nn/init.h"
#include "nn/linear.h"

namespace o2v {

/// MlpTrunk(n_in, h): Linear(n_in -> h), g, Linear(h -> h), g. Source: spec 2.1, whose Body it is.
struct MlpTrunk {
  Linear layer0, layer1;
  Activation g = Activation::kTanh;

  struct Cache {
    Mat h0, h1;  // (h, B) activations; h1 is the output
    Mat dh0;     // (h, B) scratch of Backward
  };

  MlpTrunk() = default;
  /// `name`.0.W, `name`.0.b, `name`.1.W, `name`.1.b; orthogonal weights of gain 1, zero biases.
  MlpTrunk(const std::string& name, Index n_in, Index h, Activation activation,
           const Initialiser& init);

  /// x (n_in, B) -> cache.h1 (h, B).
  void Forward(const ConstMatRef& x, Cache& cache) const;
  /// dh1 = dL/dh1 (h, B), overwritten. Adds to the gradients; inputs need no gradient anywhere.
  void Backward(const ConstMatRef& x, Cache& cache, Mat& dh1);

  /// The same with the caller's arrays, all (h, B): h0, h1 the activations, dh1 overwritten, dh0
  /// left as the adjoint of the first layer's output.
  void Forward(const ConstMatRef& x, MatRef h0, MatRef h1) const;
  void Backward(const ConstMatRef& x, const ConstMatRef& h0, const ConstMatRef& h1, MatRef dh1,
                MatRef dh0);

  std::vector<Param*> Params();
};

/// A body and a linear output layer (weights orthogonal x 1e-3, bias 0). Source: spec 2.1.
struct Mlp {
  MlpTrunk body;
  Linear head;

  struct Cache {
    MlpTrunk::Cache body;
    Mat out, dout;  // (n_out, B); dout, the adjoint of out, is the input of Backward
    Mat dhidden;    // (h, B) scratch
  };

  Mlp() = default;
  Mlp(const std::string& body_name, const std::string& head_name, Index n_in, Index h, Index n_out,
      Activation activation, const Initialiser& init);

  /// x (n_in, B) -> cache.out.
  void Forward(const ConstMatRef& x, Cache& cache) const;
  /// From cache.dout. Adds to the gradients and leaves cache.body.dh0 for a caller whose input
  /// learns.
  void Backward(const ConstMatRef& x, Cache& cache);

  std::vector<Param*> Params();
};

}  // namespace o2v
