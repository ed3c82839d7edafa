#include "bench/bound.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <tuple>

#include "base/check.h"
#include "nn/product.h"
#include "report/param_table.h"

namespace o2v::bench {
namespace {

/// Adds the products of layers on B columns.
struct Layers {
  std::vector<Product>& out;
  double per_step;  // passes an environment step

  // ---- A linear layer (n_in -> n_out).
  void Forward(const std::string& what, Index n_in, Index n_out, Index B) {
    out.push_back({what + " forward", n_out, n_in, B, per_step});
  }
  void Weight(const std::string& what, Index n_in, Index n_out, Index B) {
    out.push_back({what + " weight gradient", n_out, B, n_in, per_step});
  }
  void Input(const std::string& what, Index n_in, Index n_out, Index B) {
    out.push_back({what + " input gradient", n_in, n_out, B, per_step});
  }

  // ---- A body and its head (n_in -> h -> h -> n_out).
  void NetForward(const std::string& name, Index n_in, Index h, Index n_out, Index B) {
    Forward(name + " layer 0", n_in, h, B);
    Forward(name + " layer 1", h, h, B);
    Forward(name + " head", h, n_out, B);
  }
  void NetGradients(const std::string& name, Index n_in, Index h, Index n_out, Index B) {
    Weight(name + " layer 0", n_in, h, B);
    Weight(name + " layer 1", h, h, B);
    Input(name + " layer 1", h, h, B);
    Weight(name + " head", h, n_out, B);
    Input(name + " head", h, n_out, B);
  }
  void NetBoth(const std::string& name, Index n_in, Index h, Index n_out, Index B) {
    NetForward(name, n_in, h, n_out, B);
    NetGradients(name, n_in, h, n_out, B);
  }
};

/// The sizes of a run.
struct Sizes {
  Index S, A, N, h;
  Sizes(const RunConfig& c, int s, int a) : S(s), A(a), N(c.workers), h(c.hyper.Int("hidden")) {}
};

/// Sizes of a run with minibatches.
struct PpoSizes : Sizes {
  Index B;
  double rollout, values, update;  // passes of N, B, B columns an environment step
  PpoSizes(const RunConfig& c, int s, int a)
      : Sizes(c, s, a),
        B(c.hyper.Int("minibatch")),
        rollout(1.0 / double(N)),
        values(1.0 / double(B)),
        update(c.hyper.Real("epochs") / double(B)) {}
};

std::vector<Product> PpoProducts(const RunConfig& config, int S, int A) {
  const PpoSizes z(config, S, A);
  std::vector<Product> out;
  Layers{out, z.rollout}.NetForward("rollout actor", z.S, z.h, z.A, z.N);
  Layers{out, z.values}.NetForward("values critic", z.S, z.h, 1, z.B);
  Layers{out, z.update}.NetBoth("update actor", z.S, z.h, z.A, z.B);
  Layers{out, z.update}.NetBoth("update critic", z.S, z.h, 1, z.B);
  return out;
}

// ---- Methods with one network an option --------------------------------------------------------

using Pass = void (Layers::*)(const std::string&, Index n_in, Index h, Index n_out, Index B);
constexpr Pass kForward = &Layers::NetForward, kGradients = &Layers::NetGradients,
               kBoth = &Layers::NetBoth;

/// Products of the networks of spec 2.3: `per_step` passes of B columns.
struct OptionProducts {
  const Index S, h, K;
  const bool all_betas;  // beta_index = released asks for the terminations of all options
  std::vector<Product> out;

  OptionProducts(const RunConfig& c, const Sizes& z)
      : S(z.S),
        h(z.h),
        K(c.hyper.Int("options")),
        all_betas(c.switches.beta_index == Fidelity::kReleased) {}

  /// A network that all options share: master, critic.
  void Shared(Pass pass, double per_step, const std::string& name, Index n_out, Index B) {
    (Layers{out, per_step}.*pass)(name, S, h, n_out, B);
  }
  /// Networks of the options, each sample through that of one: K groups of B / K columns.
  void One(Pass pass, double per_step, const std::string& name, Index n_out, Index B) {
    const Index columns = std::max<Index>(1, B / K);
    Shared(pass, per_step * double(B) / double(columns), name, n_out, columns);
  }
  /// Networks of the options, each sample through all K.
  void All(Pass pass, double per_step, const std::string& name, Index n_out, Index B) {
    Shared(pass, per_step * double(K), name, n_out, B);
  }
  /// The terminations that the call-and-return policy asks for.
  void Terminations(Pass pass, double per_step, const std::string& name, Index B) {
    all_betas ? All(pass, per_step, name, 1, B) : One(pass, per_step, name, 1, B);
  }
};

/// DAC's two stages around an option policy: option_policy(p, pass, per_step, stage, B).
template <typename OptionPolicy>
std::vector<Product> DoubleActorCriticProducts(const RunConfig& config, int S, int A,
                                               OptionPolicy&& option_policy) {
  const PpoSizes z(config, S, A);
  OptionProducts p(config, z);
  option_policy(p, kForward, z.rollout, "rollout ", z.N);
  p.One(kForward, z.rollout, "rollout options", z.A, z.N);
  p.Shared(kForward, z.values, "values critic", p.K, z.B);
  option_policy(p, kBoth, z.update, "high stage ", z.B);
  p.Shared(kBoth, z.update, "high stage critic", p.K, z.B);
  p.One(kBoth, z.update, "low stage options", z.A, z.B);
  p.Shared(kBoth, z.update, "low stage critic", p.K, z.B);
  return p.out;
}

std::vector<Product> DacPpoProducts(const RunConfig& config, int S, int A) {
  return DoubleActorCriticProducts(
      config, S, A,
      [](OptionProducts& p, Pass pass, double per_step, const std::string& stage, Index B) {
        p.Shared(pass, per_step, stage + "master", p.K, B);
        p.Terminations(pass, per_step, stage + "terminations", B);
      });
}

std::vector<Product> DacOneStepProducts(const RunConfig& config, int S, int A) {
  const bool number = config.switches.onestep_index == Fidelity::kReleased;
  const bool swapped = config.switches.onestep_roles == Fidelity::kReleased;
  const Index h_y = config.hyper.Int("ynet_hidden");
  return DoubleActorCriticProducts(
      config, S, A,
      [=](OptionProducts& p, Pass pass, double per_step, const std::string& stage, Index B) {
        Layers l{p.out, per_step};
        if (!swapped) {  // a one-hot o' is a column of the weights, its number an input
          (l.*pass)(stage + "option policy", p.S + (number ? 1 : 0), p.h, p.K, B);
          return;
        }
        // The net y. The other one serves first states alone: too few to count.
        l.Forward(stage + "y layer 0", p.S, h_y, B);
        l.Forward(stage + "y layer 1", h_y, p.K, B);
        if (pass == kForward) return;
        l.Weight(stage + "y layer 0", p.S, h_y, B);
        l.Weight(stage + "y layer 1", h_y, p.K, B);
        l.Input(stage + "y layer 1", h_y, p.K, B);
      });
}

std::vector<Product> AhpPpoProducts(const RunConfig& config, int S, int A) {
  // The master policy matters only where the option stops: beta = 1/2 before the terminations have
  // learnt.
  constexpr double kStops = 0.5;
  const PpoSizes z(config, S, A);
  OptionProducts p(config, z);
  p.Shared(kForward, kStops * z.rollout, "rollout master", p.K, z.N);
  p.One(kForward, z.rollout, "rollout terminations", 1, z.N);
  p.One(kForward, z.rollout, "rollout options", z.A, z.N);
  p.Shared(kForward, z.values, "values critic", p.K + 1, z.B);
  p.Shared(kBoth, kStops * z.update, "update master", p.K, z.B);
  p.One(kBoth, z.update, "update terminations", 1, z.B);
  p.One(kBoth, z.update, "update options", z.A, z.B);
  p.Shared(kBoth, z.update, "update critic", p.K + 1, z.B);
  return p.out;
}

std::vector<Product> PpocProducts(const RunConfig& config, int S, int A) {
  const PpoSizes z(config, S, A);
  OptionProducts p(config, z);
  p.Shared(kForward, z.rollout, "rollout master", p.K, z.N);
  p.Terminations(kForward, z.rollout, "rollout terminations", z.N);
  p.One(kForward, z.rollout, "rollout options", z.A, z.N);
  p.Shared(kForward, z.values, "values critic", p.K, z.B);
  p.Shared(kBoth, z.update, "update master", p.K, z.B);
  p.One(kBoth, z.update, "update terminations", 1, z.B);  // of o' alone, whatever beta_index
  if (p.all_betas && config.switches.ppoc_master_weight == Fidelity::kPaper) {
    p.One(kForward, z.update, "update terminations of o", 1, z.B);
  }
  p.One(kBoth, z.update, "update options", z.A, z.B);
  p.Shared(kBoth, z.update, "update critic", p.K, z.B);
  return p.out;
}

std::vector<Product> OcProducts(const RunConfig& config, int S, int A) {
  const Sizes z(config, S, A);
  OptionProducts p(config, z);
  const Index n = config.hyper.Int("rollout") * z.N;
  const double rollout = 1.0 / double(z.N), update = 1.0 / double(n);
  p.Shared(kForward, rollout, "rollout critic", p.K, z.N);
  p.Terminations(kForward, rollout, "rollout terminations", z.N);
  p.One(kForward, rollout, "rollout options", z.A, z.N);
  p.Shared(kForward, update, "target critic", p.K, z.N);
  p.One(kForward, update, "target terminations", 1, z.N);
  p.Shared(kGradients, update, "update critic", p.K, n);
  p.One(kGradients, update, "update terminations", 1, n);
  p.One(kGradients, update, "update options", z.A, n);
  return p.out;
}

std::vector<Product> IopgProducts(const RunConfig& config, int S, int A) {
  constexpr Index kBlock = 64;  // steps of an episode that are learnt from together
  const Sizes z(config, S, A);
  OptionProducts p(config, z);
  const bool terminations = config.switches.iopg_init_flag == Fidelity::kPaper;
  const double update = 1.0 / double(kBlock);
  // Each worker acts with its own copy. Acting has passed through one option of K.
  const double others = update * double(p.K - 1) / double(p.K);
  p.Shared(kForward, 1, "rollout master", p.K, 1);
  if (terminations) p.Terminations(kForward, 1, "rollout terminations", 1);
  p.One(kForward, 1, "rollout options", z.A, 1);
  p.Shared(kGradients, update, "update master", p.K, kBlock);
  p.Shared(kBoth, update, "update critic", 1, kBlock);  // v is the first entry of q
  p.All(kForward, others, "update options", z.A, kBlock);
  p.All(kGradients, update, "update options", z.A, kBlock);
  if (!terminations) return p.out;
  if (!p.all_betas) p.All(kForward, others, "update terminations", 1, kBlock);
  p.All(kGradients, update, "update terminations", 1, kBlock);
  return p.out;
}

// ---- Option2Vec --------------------------------------------------------------------------------

std::vector<Product> Option2VecProducts(const RunConfig& config, int S, int A) {
  const PpoSizes z(config, S, A);
  const Index D = config.hyper.Int("embedding"), K = config.hyper.Int("options"),
              F = config.hyper.Int("ffn"), heads = config.hyper.Int("heads"), HK = heads * K;
  const bool scalar = config.switches.o2v_critic == Fidelity::kPaper;
  const Index tokens = config.switches.o2v_query == Fidelity::kPaper ? 1 : 2;
  const bool prev_grad = config.switches.o2v_prev_embed_grad == Fidelity::kPaper;
  std::vector<Product> out;

  // What all samples of a batch share: columns are the K options.
  const auto memory = [&](Layers l, const std::string& name, bool learn) {
    const Index d = D / heads;
    Layers each_head{l.out, l.per_step * double(heads)};
    l.Forward(name + " keys", D, D, K);
    l.Forward(name + " values", D, D, K);
    each_head.Input(name + " score map", D, d, K);  // W_q^T keys
    each_head.Forward(name + " output map", d, D, K);
    if (!learn) return;
    each_head.Weight(name + " score map", D, d, K);
    each_head.Forward(name + " keys' gradient", D, d, K);
    each_head.Weight(name + " output map", d, D, K);
    each_head.Input(name + " output map", d, D, K);
    for (const char* projection : {" keys", " values"}) {
      l.Weight(name + projection, D, D, K);
      l.Input(name + projection, D, D, K);
    }
  };
  const auto table = [&](Layers l, const std::string& name, Index n_out, bool learn) {
    l.Forward(name + " layer 0 of options", D, n_out, K);
    if (learn) l.Weight(name + " layer 0 of options", D, n_out, K);
  };
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
    l.Input(name + " attention scores", D, HK, prev_grad ? n : B);
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
  options({out, z.rollout}, "rollout options", z.N, false);
  action({out, z.rollout}, "rollout action", z.N, false);
  critic({out, z.values}, "values critic", z.B, scalar ? K * z.B : z.B, false);
  memory({out, z.update}, "option stage memory", true);
  if (tokens == 1) table({out, z.update}, "option stage query", D, true);
  options({out, z.update}, "option stage options", z.B, true);
  if (scalar) table({out, z.update}, "option stage critic", z.h, true);
  critic({out, z.update}, "option stage critic", z.B, scalar ? K * z.B : z.B, true);
  if (config.switches.o2v_option_in_update == Fidelity::kReleased) {
    memory({out, z.update}, "action stage memory", false);
    options({out, z.update}, "action stage options", z.B, false);
  }
  table({out, z.update}, "action stage action", z.h, true);
  action({out, z.update}, "action stage action", z.B, true);
  if (scalar) table({out, z.update}, "action stage critic", z.h, true);
  critic({out, z.update}, "action stage critic", z.B, z.B, true);
  return out;
}

// ---- Timings -----------------------------------------------------------------------------------

/// CPU seconds a call, the least of several timed batches of calls.
template <typename Work>
double Seconds(Work&& work) {
  using Clock = std::chrono::steady_clock;
  constexpr int kBatches = 3;
  constexpr double kBatchSeconds = 1e-3;
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
  using List = std::vector<Product> (*)(const RunConfig&, int, int);
  static const std::map<std::string, List> lists = {{"option2vec", Option2VecProducts},
                                                    {"dac_onestep", DacOneStepProducts},
                                                    {"dac_ppo", DacPpoProducts},
                                                    {"ahp_ppo", AhpPpoProducts},
                                                    {"iopg", IopgProducts},
                                                    {"ppoc", PpocProducts},
                                                    {"oc", OcProducts},
                                                    {"ppo", PpoProducts}};
  const auto list = lists.find(config.algorithm);
  Check(list != lists.end(), config.algorithm, ": no list of products");
  return list->second(config, S, A);
}

double AdamEntriesPerStep(const RunConfig& config, int S, int A, double episode_length) {
  EnvSpec spec;
  spec.S = S;
  spec.A = A;
  const auto algorithm = MakeRunAlgorithm(config, spec);
  const std::vector<Param*> params = algorithm->Params();
  const bool idle_move = config.switches.adam_idle == Fidelity::kReleased;
  const std::vector<char> used = InAnyGraph(*algorithm);
  double entries = 0;  // in a step of each stage
  for (int stage = 0; stage < int(algorithm->StageNames().size()); ++stage) {
    const std::vector<char> in_graph = idle_move ? used : algorithm->InGraph(stage);
    for (std::size_t i = 0; i < params.size(); ++i) {
      if (in_graph[i]) entries += double(params[i]->value.size());
    }
  }
  const Settings& hyper = config.hyper;
  if (hyper.Has("minibatch")) return entries * hyper.Real("epochs") / hyper.Real("minibatch");
  if (hyper.Has("rollout")) return entries / (hyper.Real("rollout") * config.workers);  // OC
  return entries / episode_length;                                                      // IOPG
}

double ProductSeconds(Index m, Index k, Index n) {
  const Mat a = Mat::Random(m, k), b = Mat::Random(k, n);
  Mat c = Mat::Zero(m, n);
  const auto seconds = [&](auto&& multiply) {
    return Seconds([&] {
      multiply();
      asm volatile("" : : "r"(c.data()) : "memory");
    });
  };
  return std::min(seconds([&] { c.noalias() = a * b; }), seconds([&] { SetAB(a, b, c); }));
}

double ProductSecondsPerStep(const std::vector<Product>& products) {
  std::map<std::tuple<Index, Index, Index>, double> per_step;
  for (const Product& p : products) per_step[{p.m, p.k, p.n}] += p.per_step;
  double seconds = 0;
  for (const auto& [shape, times] : per_step) {
    seconds += times * std::apply(ProductSeconds, shape);
  }
  return seconds;
}

double AdamSecondsPerEntry() {
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
}

}  // namespace o2v::bench
