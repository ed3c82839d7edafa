#include <memory>

#include "gradcheck/checks.h"
#include "nn/activation.h"
#include "nn/attention_block.h"
#include "nn/dropout.h"
#include "nn/embedding.h"
#include "nn/layer_norm.h"
#include "nn/linear.h"
#include "nn/mlp.h"
#include "random_mat.h"

namespace o2v {
namespace {

constexpr Index kB = 5;  // columns of a batch

/// Weights away from their initial zeros and ones.
void Randomize(const std::vector<Param*>& params, Rng& rng) {
  for (Param* p : params) p->value = RandomMat(p->value.rows(), p->value.cols(), rng, 0.7);
}

void AddSlots(const std::vector<Param*>& params, const std::function<double()>& loss,
              std::vector<Slot>& slots) {
  for (Param* p : params) {
    slots.emplace_back(p->name, p->value, p->grad, loss,
                       p->name.ends_with(".bk") ? Expect::kShift : Expect::kGradient);
  }
}

Comparison CheckLinear() {
  Rng rng(1, "gradcheck.linear");
  Linear f("linear", 4, 3);
  Randomize(f.Params(), rng);
  Mat x = RandomMat(4, kB, rng), dx(4, kB), y(3, kB);
  const Mat dy = RandomMat(3, kB, rng);
  const auto loss = [&] {
    f.Forward(x, y);
    return y.cwiseProduct(dy).sum();
  };
  f.AddGrad(x, dy);
  f.BackwardInput(dy, dx);
  std::vector<Slot> slots = {{"x", x, dx, loss}};
  AddSlots(f.Params(), loss, slots);
  return Compare(slots, rng);
}

Comparison CheckActivation(Activation g) {
  Rng rng(2, "gradcheck.activation");
  Mat z, b;
  do {
    z = RandomMat(4, kB, rng);
    b = RandomMat(4, 1, rng);
  } while (ReluMargin(z.colwise() + b.col(0)) < kReluMargin);
  const Mat dy = RandomMat(4, kB, rng);
  Mat y;
  const auto loss = [&] {
    y = z;
    BiasActivate(g, b, y);
    return y.cwiseProduct(dy).sum();
  };
  loss();
  Mat dz = dy;
  ActivationBackward(g, y, dz);
  const Mat db = dz.rowwise().sum();
  return Compare({{"z", z, dz, loss}, {"b", b, db, loss}}, rng);
}

/// An elementwise function in place and its backward pass, over inputs on both sides of its bends.
Comparison CheckElementwise(void (*f)(MatRef), void (*backward)(const ConstMatRef&, MatRef)) {
  Rng rng(3, "gradcheck.elementwise");
  Mat x = RandomMat(3, kB, rng, 2);
  x.row(0) << -9, -5, 0, 19.9, 20.1;  // softplus is linear above 20
  Mat dy = RandomMat(3, kB, rng);
  dy.row(0) *= 0.1;  // values of 20 would drown small differences in their rounding
  Mat y;
  const auto loss = [&] {
    y = x;
    f(y);
    return y.cwiseProduct(dy).sum();
  };
  loss();
  Mat dx = dy;
  backward(y, dx);
  return Compare({{"x", x, dx, loss}}, rng);
}

Comparison CheckBody(Activation g) {
  Rng rng(4, "gradcheck.body");
  MlpTrunk body("body", 4, 6, g, rng);
  MlpTrunk::Cache cache;
  Mat x, z0, z1;
  do {
    Randomize(body.Params(), rng);
    x = RandomMat(4, kB, rng);
    body.Forward(x, cache);
    z0 = (body.layer0.W.value * x).colwise() + body.layer0.b.value.col(0);
    z1 = (body.layer1.W.value * cache.h0).colwise() + body.layer1.b.value.col(0);
  } while (std::min(ReluMargin(z0), ReluMargin(z1)) < kReluMargin);
  const Mat dh1 = RandomMat(6, kB, rng);
  const auto loss = [&] {
    body.Forward(x, cache);
    return cache.h1.cwiseProduct(dh1).sum();
  };
  Mat adjoint = dh1;
  body.Backward(x, cache, adjoint);
  std::vector<Slot> slots;
  AddSlots(body.Params(), loss, slots);
  return Compare(slots, rng);
}

/// n = 29: pieces of 8, 4 and 1 lanes; 15: nothing beyond the last.
template <int n>
Comparison CheckLayerNorm() {
  Rng rng(5, "gradcheck.layer_norm");
  LayerNorm norm("norm", n);
  Randomize(norm.Params(), rng);
  LayerNorm::Cache cache;
  Mat x = RandomMat(n, kB, rng), y(n, kB), dx(n, kB);
  const Mat dy = RandomMat(n, kB, rng);
  const auto loss = [&] {
    norm.Forward(x, cache, y);
    return y.cwiseProduct(dy).sum();
  };
  loss();
  norm.Backward(cache, dy, dx);
  std::vector<Slot> slots = {{"x", x, dx, loss}};
  AddSlots(norm.Params(), loss, slots);
  return Compare(slots, rng);
}

Comparison CheckEmbedding() {
  Rng rng(6, "gradcheck.embedding");
  Mat E = RandomMat(3, 4, rng), y(3, kB), dE = Mat::Zero(3, 4);
  const Mat dy = RandomMat(3, kB, rng);
  const std::vector<int> o = {1, 3, 1, 0, 1};  // a repeated column and one that nobody uses
  const auto loss = [&] {
    GatherColumns(E, o, y);
    return y.cwiseProduct(dy).sum();
  };
  ScatterColumns(dy, o, dE);
  return Compare({{"E", E, dE, loss}}, rng);
}

Comparison CheckEmbeddedLinear() {
  Rng rng(7, "gradcheck.embedded_linear");
  EmbeddedLinear f("map", 4, 3, 6);
  Randomize(f.Params(), rng);
  Mat E = RandomMat(3, 4, rng), dE = Mat::Zero(3, 4), dtable = Mat::Zero(6, 4), table, y(6, kB);
  const Mat x = RandomMat(4, kB, rng), dy = RandomMat(6, kB, rng);
  const std::vector<int> o = {1, 3, 1, 0, 1};
  const auto loss = [&] {
    f.MakeTable(E, table);
    f.MultiplyState(x, y);
    for (Index b = 0; b < kB; ++b) y.col(b) += table.col(o[std::size_t(b)]);
    return y.cwiseProduct(dy).sum();
  };
  f.AddStateGrad(x, dy);
  ScatterColumns(dy, o, dtable);
  f.AddTableGrad(E, dtable, &dE);
  std::vector<Slot> slots = {{"E", E, dE, loss}};
  AddSlots(f.Params(), loss, slots);
  return Compare(slots, rng);
}

Comparison CheckAttention(Index heads, bool dropout) {
  Rng rng(8, "gradcheck.attention");
  constexpr Index D = 6, K = 4;
  MemoryAttention attention("attention", D, heads);
  Randomize(attention.Params(), rng);
  MemoryAttention::Memory memory;
  MemoryAttention::Cache cache;
  Mat E = RandomMat(D, K, rng), dE = Mat::Zero(D, K);
  Mat x = RandomMat(D, kB, rng), y(D, kB), dx(D, kB), kept(heads * K, kB);
  Mat y0 = Mat::Zero(D, kB);  // subtracted, so that the loss is small and its rounding too
  const Mat dy = RandomMat(D, kB, rng);
  DrawDropoutMask(0.2, rng, kept);
  const Mat* mask = dropout ? &kept : nullptr;
  const auto loss = [&] {
    attention.Project(E, memory);
    attention.Forward(x, memory, mask, cache, y);
    return (y - y0).cwiseProduct(dy).sum();
  };
  loss();
  y0 = y;
  attention.Backward(x, E, memory, mask, cache, dy, dx, dE);
  std::vector<Slot> slots = {{"x", x, dx, loss}, {"E", E, dE, loss}};
  AddSlots(attention.Params(), loss, slots);
  return Compare(slots, rng);
}

Comparison CheckAttentionBlock(Index heads, bool dropout) {
  Rng rng(9, "gradcheck.attention_block");
  constexpr Index D = 6, K = 4, F = 7;
  AttentionBlock block("attention", "block", D, heads, F);
  MemoryAttention::Memory memory;
  AttentionBlock::Cache cache;
  AttentionBlock::Masks kept;
  kept.Resize(heads * K, D, F, kB);
  kept.Draw(0.2, rng);
  const AttentionBlock::Masks* masks = dropout ? &kept : nullptr;
  Mat E, x, z;
  const auto forward = [&] {
    block.attention.Project(E, memory);
    block.Forward(x, memory, masks, cache);
  };
  do {
    Randomize(block.Params(), rng);
    E = RandomMat(D, K, rng);
    x = RandomMat(D, kB, rng);
    forward();
    z = (block.ffn0.W.value * cache.y).colwise() + block.ffn0.b.value.col(0);
  } while (ReluMargin(z) < kReluMargin);
  const Mat dout = RandomMat(D, kB, rng);
  const Mat out0 = cache.out;  // subtracted, so that the loss is small and its rounding too
  const auto loss = [&] {
    forward();
    return (cache.out - out0).cwiseProduct(dout).sum();
  };
  Mat adjoint = dout, dx(D, kB), dE = Mat::Zero(D, K);
  block.Backward(x, E, memory, masks, cache, adjoint, dx, dE);
  std::vector<Slot> slots = {{"x", x, dx, loss}, {"E", E, dE, loss}};
  AddSlots(block.Params(), loss, slots);
  return Compare(slots, rng);
}

}  // namespace

std::vector<NamedCheck> NnChecks() {
  std::vector<NamedCheck> checks = {
      {"linear", CheckLinear},
      {"tanh", [] { return CheckActivation(Activation::kTanh); }},
      {"relu", [] { return CheckActivation(Activation::kRelu); }},
      {"softplus", [] { return CheckElementwise(Softplus, SoftplusBackward); }},
      {"sigmoid", [] { return CheckElementwise(Sigmoid, SigmoidBackward); }},
      {"body tanh", [] { return CheckBody(Activation::kTanh); }},
      {"body relu", [] { return CheckBody(Activation::kRelu); }},
      {"layer_norm", CheckLayerNorm<6>},
      {"layer_norm.15", CheckLayerNorm<15>},
      {"layer_norm.29", CheckLayerNorm<29>},
      {"embedding", CheckEmbedding},
      {"embedded_linear", CheckEmbeddedLinear},
  };
  for (const bool dropout : {false, true}) {
    const std::string suffix = dropout ? " dropout" : "";
    for (const Index heads : {1, 2, 3}) {
      const std::string name = " heads=" + std::to_string(heads) + suffix;
      checks.push_back({"attention" + name, [=] { return CheckAttention(heads, dropout); }});
      checks.push_back(
          {"attention_block" + name, [=] { return CheckAttentionBlock(heads, dropout); }});
    }
  }
  return checks;
}

}  // namespace o2v
