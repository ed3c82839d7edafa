#include "nn/attention_block.h"

#include <cmath>

#include "nn/activation.h"
#include "nn/dropout.h"

namespace o2v {
namespace {

/// y := x + mask * y, in one pass; mask null: ones.
void AddDropped(const ConstMatRef& x, const Mat* mask, Mat& y) {
  if (mask) {
    y.array() = x.array() + mask->array() * y.array();
  } else {
    y += x;
  }
}

/// out := mask * d: the backward of dropout.
void CopyDropped(const Mat& d, const Mat* mask, Mat& out) {
  if (mask) {
    out = d.cwiseProduct(*mask);
  } else {
    out = d;
  }
}

}  // namespace

void AttentionBlock::Masks::Resize(Index HK, Index D, Index F, Index n) {
  attention.resize(HK, n);
  after_attention.resize(D, n);
  inside_ffn.resize(F, n);
  after_ffn.resize(D, n);
}

void AttentionBlock::Masks::Draw(double p, Rng& rng) {
  for (Mat* mask : {&attention, &after_attention, &inside_ffn, &after_ffn}) {
    DrawDropoutMask(p, rng, *mask);
  }
}

AttentionBlock::AttentionBlock(const std::string& attention_name, const std::string& name, Index D,
                               Index heads, Index F)
    : attention(attention_name, D, heads),
      ln2(name + ".ln2", D),
      ln3(name + ".ln3", D),
      ln_final(name + ".ln_final", D),
      ffn0(name + ".ffn.0", D, F),
      ffn1(name + ".ffn.1", F, D) {}

void AttentionBlock::Init(const Initialiser& init) {
  attention.Init(init);
  for (Linear* layer : {&ffn0, &ffn1}) {
    init.XavierUniform(layer->W.value);
    init.Uniform(layer->b.value, 1 / std::sqrt(static_cast<double>(layer->W.value.cols())));
  }
}

std::vector<Param*> AttentionBlock::Params() {
  std::vector<Param*> params = attention.Params();
  Append(params, ln2.Params());
  Append(params, ffn0.Params());
  Append(params, ffn1.Params());
  Append(params, ln3.Params());
  Append(params, ln_final.Params());
  return params;
}

void AttentionBlock::Forward(const ConstMatRef& x, const MemoryAttention::Memory& memory,
                             const Masks* masks, Cache& c) const {
  const Index n = x.cols();
  c.y.resize(x.rows(), n);
  c.out.resize(x.rows(), n);
  c.hidden.resize(ffn0.W.value.rows(), n);
  attention.Forward(x, memory, masks ? &masks->attention : nullptr, c.attention, c.y);
  AddDropped(x, masks ? &masks->after_attention : nullptr, c.y);
  ln2.Forward(c.y, c.ln2, c.y);

  ffn0.Multiply(c.y, c.hidden);
  BiasActivate(Activation::kRelu, ffn0.b.value, c.hidden);
  if (masks) c.hidden.array() *= masks->inside_ffn.array();
  ffn1.Forward(c.hidden, c.out);
  AddDropped(c.y, masks ? &masks->after_ffn : nullptr, c.out);
  ln3.Forward(c.out, c.ln3, c.out);
  ln_final.Forward(c.out, c.ln_final, c.out);
}

void AttentionBlock::Backward(const ConstMatRef& x, const Mat& E,
                              const MemoryAttention::Memory& memory, const Masks* masks, Cache& c,
                              Mat& dout, MatRef dx, Mat& dE) {
  c.d_y.resize(x.rows(), x.cols());
  c.d_hidden.resize(c.hidden.rows(), x.cols());
  ln_final.Backward(c.ln_final, dout, dout);
  ln3.Backward(c.ln3, dout, dout);
  // Towards the FFN; dout itself goes on along the residual.
  CopyDropped(dout, masks ? &masks->after_ffn : nullptr, c.d_out);
  ffn1.AddGrad(c.hidden, c.d_out);
  ffn1.BackwardInput(c.d_out, c.d_hidden);
  // A dropped unit is 0 in `hidden`, so ReLU's mask drops its gradient as well; a kept one is
  // scaled.
  ActivationBackward(Activation::kRelu, c.hidden, c.d_hidden);
  if (masks) c.d_hidden.array() *= masks->inside_ffn.array();
  ffn0.AddGrad(c.y, c.d_hidden);
  ffn0.BackwardInput(c.d_hidden, c.d_y);
  c.d_y += dout;
  ln2.Backward(c.ln2, c.d_y, c.d_y);
  CopyDropped(c.d_y, masks ? &masks->after_attention : nullptr, c.d_out);  // to the attention
  attention.Backward(x, E, memory, masks ? &masks->attention : nullptr, c.attention, c.d_out, dx,
                     dE);
  dx += c.d_y.leftCols(dx.cols());
}

}  // namespace o2v
