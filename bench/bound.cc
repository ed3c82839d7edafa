#include "bench/bound.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <tuple>

namespace o2v::bench {
namespace {

/// Adds the products of a linear layer (n_in -> n_out) on B columns: forward, and where it learns
/// the weight gradient and, unless it is a first layer, the input gradient.
struct Layers {
  std::vector<Product>& out;
  double per_step;  // passes an environment step

  void Forward(const std::string& what, Index n_in, Index n_out, Index B) {
    out.push_back({what + " forward", n_out, n_in, B, per_step});
  }
  void Weight(const std::string& what, Index n_in, Index n_out, Index B) {
    out.push_back({what + " weight gradient", n_out, B, n_in, per_step});
  }
  void Input(const std::string& what, Index n_in, Index n_out, Index B) {
    out.push_back({what + " input gradient", n_in, n_out, B, per_step});
  }
  void All(const std::string& what, Index n_in, Index n_out, Index B) {
    Forward(what, n_in, n_out, B);
    Weight(what, n_in, n_out, B);
    Input(what, n_in, n_out, B);
  }
};

/// The sizes of a run.
struct Sizes {
  Index S, A, N, B, h;
  double epochs;
  explicit Sizes(const RunConfig& c, int s, int a)
      : S(s),
        A(a),
        N(c.workers),
        B(c.hyper.Int("minibatch")),
        h(c.hyper.Int("hidden")),
        epochs(c.hyper.Real("epochs")) {}
  double PerMinibatch() const { return epochs / double(B); }
};

std::vector<Product> PpoProducts(const RunConfig& config, int S, int A) {
  const Sizes z(config, S, A);
  std::vector<Product> out;
  const auto net = [&](Layers layers, const std::string& name, Index n_out, Index B, bool learn) {
    layers.Forward(name + " layer 0", z.S, z.h, B);
    layers.Forward(name + " layer 1", z.h, z.h, B);
    layers.Forward(name + " head", z.h, n_out, B);
    if (!learn) return;
    layers.Weight(name + " layer 0", z.S, z.h, B);
    layers.Weight(name + " layer 1", z.h, z.h, B);
    layers.Input(name + " layer 1", z.h, z.h, B);
    layers.Weight(name + " head", z.h, n_out, B);
    layers.Input(name + " head", z.h, n_out, B);
  };
  net({out, 1.0 / double(z.N)}, "rollout actor", z.A, z.N, false);
  net({out, 1.0 / double(z.B)}, "values critic", 1, z.B, false);
  net({out, z.PerMinibatch()}, "update actor", z.A, z.B, true);
  net({out, z.PerMinibatch()}, "update critic", 1, z.B, true);
  return out;
}

std::vector<Product> Option2VecProducts(const RunConfig& config, int S, int A) {
  const Sizes z(config, S, A);
  const Index D = config.hyper.Int("embedding"), K = config.hyper.Int("options"),
              F = config.hyper.Int("ffn"), HK = config.hyper.Int("heads") * K;
  const bool scalar = config.switches.o2v_critic == Fidelity::kPaper;
  const Index tokens = config.switches.o2v_query == Fidelity::kPaper ? 1 : 2;
  std::vector<Product> out;

  const auto options = [&](Layers l, const std::string& name, Index B, bool learn) {
    const Index n = tokens * B;
    l.Forward(name + " query of state", z.S, D, B);
    l.Forward(name + " attention scores", D, HK, n);
    l.Forward(name + " attention output", HK, D, n);
    l.Forward(name + " ffn 0", D, F, n);
    l.Forward(name + " ffn 1", F, D, n);
    l.Forward(name + " logits", tokens * D, K, B);
    if (!learn) return;
    l.Weight(name + " query of state", z.S, D, B);
    l.Weight(name + " attention scores", D, HK, n);
    l.Input(name + " attention scores", D, HK, n);
    l.Weight(name + " attention output", HK, D, n);
    l.Input(name + " attention output", HK, D, n);
    l.Weight(name + " ffn 0", D, F, n);
    l.Input(name + " ffn 0", D, F, n);
    l.Weight(name + " ffn 1", F, D, n);
    l.Input(name + " ffn 1", F, D, n);
    l.Weight(name + " logits", tokens * D, K, B);
    l.Input(name + " logits", tokens * D, K, B);
  };
  const auto action = [&](Layers l, const std::string& name, Index B, bool learn) {
    l.Forward(name + " layer 0 of state", z.S, z.h, B);
    l.Forward(name + " layer 1", z.h, z.h, B);
    l.Forward(name + " mu and sigma", z.h, 2 * z.A, B);
    if (!learn) return;
    l.Weight(name + " layer 0 of state", z.S, z.h, B);
    l.Weight(name + " layer 1", z.h, z.h, B);
    l.Input(name + " layer 1", z.h, z.h, B);
    l.Weight(name + " mu and sigma", z.h, 2 * z.A, B);
    l.Input(name + " mu and sigma", z.h, 2 * z.A, B);
  };
  // m columns: B, or K B where a scalar critic evaluates every option.
  const auto critic = [&](Layers l, const std::string& name, Index B, Index m, bool learn) {
    const Index n_in = scalar ? z.S : z.S + D, n_out = scalar ? 1 : K;
    l.Forward(name + " layer 0", n_in, z.h, B);
    l.Forward(name + " layer 1", z.h, z.h, m);
    l.Forward(name + " head", z.h, n_out, m);
    if (!learn) return;
    l.Weight(name + " layer 0", n_in, z.h, B);
    l.Weight(name + " layer 1", z.h, z.h, m);
    l.Input(name + " layer 1", z.h, z.h, m);
    l.Weight(name + " head", z.h, n_out, m);
    l.Input(name + " head", z.h, n_out, m);
  };
  const double rollout = 1.0 / double(z.N), update = z.PerMinibatch();
  options({out, rollout}, "rollout options", z.N, false);
  action({out, rollout}, "rollout action", z.N, false);
  critic({out, 1.0 / double(z.B)}, "values critic", z.B, scalar ? K * z.B : z.B, false);
  options({out, update}, "option stage options", z.B, true);
  critic({out, update}, "option stage critic", z.B, scalar ? K * z.B : z.B, true);
  if (config.switches.o2v_option_in_update == Fidelity::kReleased) {
    options({out, update}, "action stage options", z.B, false);
  }
  action({out, update}, "action stage action", z.B, true);
  critic({out, update}, "action stage critic", z.B, z.B, true);
  return out;
}

/// CPU seconds a call, the least of several timed batches of calls.
template <typename Work>
double Seconds(Work&& work) {
  using Clock = std::chrono::steady_clock;
  constexpr int kBatches = 7;
  constexpr double kBatchSeconds = 2e-3;
  double best = INFINITY;
  int calls = 1;
  for (int batch = 0; batch < kBatches;) {
    const auto start = Clock::now();
    for (int i = 0; i < calls; ++i) work();
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (seconds < kBatchSeconds) {
      calls *= 2;
      continue;
    }
    best = std::min(best, seconds / calls);
    ++batch;
  }
  return best;
}

}  // namespace

std::vector<Product> Products(const RunConfig& config, int S, int A) {
  return config.algorithm == "ppo" ? PpoProducts(config, S, A) : Option2VecProducts(config, S, A);
}

double AdamEntriesPerStep(const RunConfig& config, int S, int A) {
  EnvSpec spec;
  spec.S = S;
  spec.A = A;
  const auto algorithm = MakeRunAlgorithm(config, spec);
  const std::vector<Param*> params = algorithm->Params();
  const bool idle_move = config.switches.adam_idle == Fidelity::kReleased;
  double entries = 0;
  for (int stage = 0; stage < int(algorithm->Stages().size()); ++stage) {
    const std::vector<char> in_graph = algorithm->InGraph(stage);
    for (std::size_t i = 0; i < params.size(); ++i) {
      if (in_graph[i] || idle_move) entries += double(params[i]->value.size());
    }
  }
  return entries * config.hyper.Real("epochs") / config.hyper.Real("minibatch");
}

double ProductSeconds(Index m, Index k, Index n) {
  static std::map<std::tuple<Index, Index, Index>, double> known;
  double& seconds = known[{m, k, n}];
  if (seconds == 0) {
    const Mat a = Mat::Random(m, k), b = Mat::Random(k, n);
    Mat c = Mat::Zero(m, n);
    seconds = Seconds([&] {
      c.noalias() = a * b;
      asm volatile("" : : "r"(c.data()) : "memory");
    });
  }
  return seconds;
}

double AdamSecondsPerEntry() {
  static const double seconds = [] {
    constexpr Index kEntries = 16384;  // the size of the networks here
    Eigen::ArrayXf w = Eigen::ArrayXf::Random(kEntries), g = w, m = w, v = w.abs();
    return Seconds([&] {
             const float scale = 0.5f / (std::sqrt(g.square().sum()) + 1e-6f);
             m = 0.9f * m + (0.1f * scale) * g;
             v = 0.999f * v + (0.001f * scale * scale) * g.square();
             w -= 3e-4f * m / (v.sqrt() + 1e-5f);
             asm volatile("" : : "r"(w.data()), "r"(g.data()) : "memory");
           }) /
           double(kEntries);
  }();
  return seconds;
}

}  // namespace o2v::bench
