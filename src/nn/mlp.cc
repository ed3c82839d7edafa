#include "nn/mlp.h"

namespace o2v {

MlpTrunk::MlpTrunk(const std::string& name, Index n_in, Index h, Activation activation,
                   const Initialiser& init)
    : layer0(name + ".0", n_in, h), layer1(name + ".1", h, h), g(activation) {
  init.Orthogonal(layer0.W.value, 1);
  init.Orthogonal(layer1.W.value, 1);
}

void MlpTrunk::Forward(const ConstMatRef& x, Cache& c) const {
  c.h0.resize(layer0.W.value.rows(), x.cols());
  c.h1.resize(layer1.W.value.rows(), x.cols());
  Forward(x, c.h0, c.h1);
}

void MlpTrunk::Backward(const ConstMatRef& x, Cache& c, Mat& dh1) {
  c.dh0.resize(c.h0.rows(), c.h0.cols());
  Backward(x, c.h0, c.h1, dh1, c.dh0);
}

void MlpTrunk::Forward(const ConstMatRef& x, MatRef h0, MatRef h1) const {
  layer0.Multiply(x, h0);
  BiasActivate(g, layer0.b.value, h0);
  layer1.Multiply(h0, h1);
  BiasActivate(g, layer1.b.value, h1);
}

void MlpTrunk::Backward(const ConstMatRef& x, const ConstMatRef& h0, const ConstMatRef& h1,
                        MatRef dh1, MatRef dh0) {
  ActivationBackward(g, h1, dh1);
  layer1.AddGrad(h0, dh1);
  layer1.BackwardInput(dh1, dh0);
  ActivationBackward(g, h0, dh0);
  layer0.AddGrad(x, dh0);
}

std::vector<Param*> MlpTrunk::Params() {
  std::vector<Param*> params = layer0.Params();
  Append(params, layer1.Params());
  return params;
}

Mlp::Mlp(const std::string& body_name, const std::string& head_name, Index n_in, Index h,
         Index n_out, Activation activation, const Initialiser& init)
    : body(body_name, n_in, h, activation, init), head(head_name, h, n_out) {
  init.Orthogonal(head.W.value, kHeadGain);
}

void Mlp::Forward(const ConstMatRef& x, Cache& c) const {
  body.Forward(x, c.body);
  c.out.resize(head.W.value.rows(), x.cols());
  head.Forward(c.body.h1, c.out);
}

void Mlp::Backward(const ConstMatRef& x, Cache& c) {
  c.dhidden.resize(c.body.h1.rows(), x.cols());
  head.AddGrad(c.body.h1, c.dout);
  head.BackwardInput(c.dout, c.dhidden);
  body.Backward(x, c.body, c.dhidden);
}

std::vector<Param*> Mlp::Params() {
  std::vector<Param*> params = body.Params();
  Append(params, head.Params());
  return params;
}

}  // namespace o2v
