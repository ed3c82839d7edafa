// Costs of single layers at the sizes of HalfCheetah (S = 17, A = 6) and the released Option2Vec.

#include <benchmark/benchmark.h>

#include "dist/categorical.h"
#include "dist/diag_gaussian.h"
#include "nn/adam.h"
#include "nn/attention_block.h"
#include "nn/dropout.h"
#include "nn/embedding.h"
#include "nn/mlp.h"
#include "nn/product.h"

namespace o2v {
namespace {

constexpr Index S = 17, A = 6, K = 4, D = 40, F = 50, h = 64, B = 64;

/// The three products of a layer (k -> m) on n columns, ours or bare Eigen ones: forward, W x;
/// weight gradient, dy x^T; input gradient, W^T dy.
void BM_Product(benchmark::State& state) {
  const Index m = state.range(2), k = state.range(3), n = state.range(4);
  const Mat W = Mat::Random(m, k), x = Mat::Random(k, n), dy = Mat::Random(m, n);
  Mat y(m, n), dW(m, k), dx(k, n);
  const bool ours = state.range(0) != 0;
  for (auto _ : state) {
    switch (state.range(1)) {
      case 0:
        ours ? SetAB(W, x, y) : void(y.noalias() = W * x);
        break;
      case 1:
        ours ? SetABt(dy, x, dW) : void(dW.noalias() = dy * x.transpose());
        break;
      default:
        ours ? SetAtB(W, dy, dx) : void(dx.noalias() = W.transpose() * dy);
    }
    benchmark::ClobberMemory();
  }
  const double flop = 2.0 * double(m) * double(k) * double(n) * double(state.iterations());
  state.counters["GFLOP/s"] = benchmark::Counter(flop / 1e9, benchmark::Counter::kIsRate);
}
BENCHMARK(BM_Product)
    ->ArgNames({"ours", "form", "m", "k", "n"})
    ->ArgsProduct({{0, 1}, {0, 1, 2}, {h}, {S}, {B}})
    ->ArgsProduct({{0, 1}, {0, 1, 2}, {h}, {h}, {1, 4, B}})
    ->ArgsProduct({{0, 1}, {0, 1, 2}, {F}, {D}, {2 * B}})
    ->ArgsProduct({{0, 1}, {0, 1, 2}, {K}, {D}, {2 * B}})
    ->ArgsProduct({{0, 1}, {0, 1, 2}, {D}, {D}, {K}});

void BM_BodyForward(benchmark::State& state) {
  Rng rng(1, "bench");
  const MlpTrunk body("body", S, h, state.range(0) ? Activation::kRelu : Activation::kTanh, rng);
  const Mat x = Mat::Random(S, state.range(1));
  MlpTrunk::Cache cache;
  for (auto _ : state) body.Forward(x, cache);
}
BENCHMARK(BM_BodyForward)->ArgNames({"relu", "B"})->ArgsProduct({{0, 1}, {1, 4, 64}});

void BM_BodyBackward(benchmark::State& state) {
  Rng rng(1, "bench");
  MlpTrunk body("body", S, h, state.range(0) ? Activation::kRelu : Activation::kTanh, rng);
  const Mat x = Mat::Random(S, B), dy = Mat::Random(h, B);
  MlpTrunk::Cache cache;
  body.Forward(x, cache);
  Mat dh1;
  for (auto _ : state) {
    dh1 = dy;
    body.Backward(x, cache, dh1);
  }
}
BENCHMARK(BM_BodyBackward)->ArgName("relu")->Arg(0)->Arg(1);

void BM_LayerNormForward(benchmark::State& state) {
  LayerNorm norm("ln", D);
  const Mat x = Mat::Random(D, 2 * B);
  Mat y = x;
  LayerNorm::Cache cache;
  for (auto _ : state) norm.Forward(x, cache, y);
}
BENCHMARK(BM_LayerNormForward);

void BM_LayerNormBackward(benchmark::State& state) {
  LayerNorm norm("ln", D);
  const Mat x = Mat::Random(D, 2 * B);
  Mat y = x, dx = x;
  LayerNorm::Cache cache;
  norm.Forward(x, cache, y);
  for (auto _ : state) norm.Backward(cache, x, dx);
}
BENCHMARK(BM_LayerNormBackward);

struct BlockFixture {
  AttentionBlock block{"attention", "block", D, 1, F};
  Mat E = Mat::Random(D, K), dE = Mat::Zero(D, K), x = Mat::Random(D, 2 * B), dx = x, dout = x;
  MemoryAttention::Memory memory;
  AttentionBlock::Masks masks;
  AttentionBlock::Cache cache;
  Rng rng{1, "bench"};
  BlockFixture() {
    block.Init(rng);
    block.attention.Project(E, memory);
    masks.Resize(K, D, F, 2 * B);
    masks.Draw(0.2, rng);
  }
};

void BM_AttentionProject(benchmark::State& state) {
  BlockFixture f;
  for (auto _ : state) f.block.attention.Project(f.E, f.memory);
}
BENCHMARK(BM_AttentionProject);

void BM_AttentionBlockForward(benchmark::State& state) {
  BlockFixture f;
  for (auto _ : state) f.block.Forward(f.x, f.memory, state.range(0) ? &f.masks : nullptr, f.cache);
}
BENCHMARK(BM_AttentionBlockForward)->ArgName("dropout")->Arg(0)->Arg(1);

void BM_AttentionBlockBackward(benchmark::State& state) {
  BlockFixture f;
  const AttentionBlock::Masks* masks = state.range(0) ? &f.masks : nullptr;
  f.block.Forward(f.x, f.memory, masks, f.cache);
  for (auto _ : state) {
    f.dout = f.x;
    f.block.Backward(f.x, f.E, f.memory, masks, f.cache, f.dout, f.dx, f.dE);
  }
}
BENCHMARK(BM_AttentionBlockBackward)->ArgName("dropout")->Arg(0)->Arg(1);

void BM_DropoutMasks(benchmark::State& state) {
  BlockFixture f;
  for (auto _ : state) f.masks.Draw(0.2, f.rng);
}
BENCHMARK(BM_DropoutMasks);

void BM_LogSoftmax(benchmark::State& state) {
  const Mat z = Mat::Random(K, B);
  Mat log_P, P;
  for (auto _ : state) LogSoftmax(z, log_P, P);
}
BENCHMARK(BM_LogSoftmax);

void BM_GaussianLogProbAndGrad(benchmark::State& state) {
  const Mat a = Mat::Random(A, B), mu = Mat::Random(A, B), sigma = Mat::Constant(A, B, Real(0.7));
  Vec logp, dlogp = Vec::Random(B);
  Mat dmu, dsigma;
  for (auto _ : state) {
    GaussianLogProb(a, mu, sigma, logp);
    GaussianLogProbGrad(a, mu, sigma, dlogp, dmu, dsigma);
  }
}
BENCHMARK(BM_GaussianLogProbAndGrad);

void BM_Adam(benchmark::State& state) {
  Param p("w", 64, state.range(0));
  Adam adam({&p}, {3e-4, 0.9, 0.999, 1e-5, 0.5});
  const Mat g = Mat::Random(64, state.range(0));
  const std::vector<char> in_graph{1};
  for (auto _ : state) {
    p.grad = g;
    adam.Step(in_graph, IdleRule::kSkip);
  }
  state.SetItemsProcessed(state.iterations() * p.value.size());
}
BENCHMARK(BM_Adam)->ArgName("cols")->Arg(64)->Arg(512);

}  // namespace
}  // namespace o2v
