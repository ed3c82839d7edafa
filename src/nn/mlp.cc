#include "nn/mlp.h"

#include "nn/init.h"

namespace o2v {

Body::Body(const std::string& name, Index n_in, Index h, Activation activation, Rng& rng)
    : layer0(name + ".0", n_in, h), layer1(name + ".1", h, h), g(activation) {
  Orthogonal(layer0.W.value, 1, rng);
  Orthogonal(layer1.W.value, 1, rng);
}

void Body::Forward(const ConstMatRef& x, Cache& c) const {
  c.h0.resize(layer0.W.value.rows(), x.cols());
  c.h1.resize(layer1.W.value.rows(), x.cols());
  layer0.Multiply(x, c.h0);
  BiasActivate(g, layer0.b.value, c.h0);
  layer1.Multiply(c.h0, c.h1);
  BiasActivate(g, layer1.b.value, c.h1);
}

void Body::Backward(const ConstMatRef& x, Cache& c, Mat& dh1) {
  c.dh0.resize(c.h0.rows(), c.h0.cols());
  ActivationBackward(g, c.h1, dh1);
  layer1.AddGrad(c.h0, dh1);
  layer1.BackwardInput(dh1, c.dh0);
  ActivationBackward(g, c.h0, c.dh0);
  layer0.AddGrad(x, c.dh0);
}

std::vector<Param*> Body::Params() {
  std::vector<Param*> params = layer0.Params();
  Append(params, layer1.Params());
  return params;
}

}  // namespace o2v
