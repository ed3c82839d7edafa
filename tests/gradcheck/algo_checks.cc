#include <algorithm>
#include <memory>
#include <numeric>

#include "algo/algorithm.h"
#include "algo/surrogate.h"
#include "base/check.h"
#include "dist/categorical.h"
#include "dist/diag_gaussian.h"
#include "gradcheck/checks.h"
#include "nn/attention_block.h"
#include "nn/embedding.h"
#include "random_mat.h"

namespace o2v {
namespace {

// Sizes: all different, so that a transposed product cannot pass; D is divisible by 1, 2 and 3
// heads.
constexpr int kS = 5, kA = 3, kK = 4, kHidden = 8, kD = 6, kF = 7, kInitHidden = 64;
constexpr int kB = 10;
constexpr int kEntries = 21;  // of each tensor: 20 random ones, spec 10.2, and the largest
constexpr double kEntropyWeight = 0.1;  // ours: large enough for an error in the term to show
constexpr double kClip = 0.2;           // spec 7

/// A network to check.
struct Setup {
  std::string method;
  Switches switches;
  int heads = 1;
  int activation = 0;  // of ppo: 0 tanh, 1 ReLU
};

Settings Hyper(const Setup& setup) {
  Settings hyper;
  const auto set = [&](const char* key, double value) { hyper.Set(key, value, "gradcheck"); };
  set("gamma", 0.99);
  set("lambda", 0.95);
  set("rollout", kB);
  set("epochs", 1);
  set("minibatch", kB);
  set("learning_rate", 3e-4);
  set("adam_beta1", 0.9);
  set("adam_beta2", 0.999);
  set("adam_eps", 1e-5);
  set("clip_norm", 0.5);
  set("ratio_clip", kClip);
  set("hidden", kHidden);
  if (setup.method == "ppo") {
    set("entropy_weight", kEntropyWeight);
    set("activation", setup.activation);
  } else {
    set("options", kK);
    set("embedding", kD);
    set("heads", setup.heads);
    set("ffn", kF);
    set("init_hidden", kInitHidden);
    set("entropy_weight_option", kEntropyWeight);
    set("entropy_weight_action", kEntropyWeight);
  }
  return hyper;
}

Mat Stack(const Mat& top, const Mat& bottom) {
  Mat x(top.rows() + bottom.rows(), top.cols());
  x << top, bottom;
  return x;
}

/// A network with random weights and a batch on both sides of every bend of its losses: both signs
/// of the advantage inside and outside both clip edges, first states of episodes and others.
class Problem {
 public:
  Problem(const Setup& setup, std::uint64_t seed);

  /// Distance of the nearest ReLU input from 0.
  double Margin() const { return margin_; }
  /// Every tensor, on the whole batch.
  Comparison Whole(int stage);
  /// The output layers' biases, whose gradients on one sample are the adjoints of its outputs.
  Comparison Outputs(int stage);

 private:
  struct OptionPass {
    Mat log_P, P;  // (K, B)
  };

  bool Option2Vec() const { return setup_.method == "option2vec"; }
  static bool Released(Fidelity f) { return f == Fidelity::kReleased; }
  Param& Named(const std::string& name);
  template <typename Layer>
  Layer& Load(Layer& layer);
  Mat Affine(const std::string& name, const Mat& x);
  Mat Relu(const Mat& z);
  void HiddenLayers(const std::string& body, const Mat& x);
  void VisitRelus();
  OptionPass Options(const Mat& query_embedding);
  double OptionObjective(const OptionPass& base, const Mat& W_o, const Mat& q);

  Expect Expected(int stage, const std::string& name) const;
  std::function<double()> LossOf(int stage, const std::string& name, const Batch& batch,
                                 const FixedDraws& fixed);

  Setup setup_;
  Settings hyper_;
  std::unique_ptr<Algorithm> algo_;
  std::vector<Param*> params_;
  Batch batch_;
  FixedDraws fixed_;
  double margin_ = std::numeric_limits<double>::infinity();
  Rng rng_;
};

Problem::Problem(const Setup& setup, std::uint64_t seed)
    : setup_(setup), hyper_(Hyper(setup)), rng_(seed, "gradcheck." + setup.method) {
  AlgorithmInput in;
  in.S = kS;
  in.A = kA;
  in.hyper = &hyper_;
  in.switches = setup.switches;
  in.seed = seed;
  algo_ = MakeAlgorithm(setup.method, in);
  params_ = algo_->Params();
  for (Param* p : params_) p->value += RandomMat(p->value.rows(), p->value.cols(), rng_, 0.3);

  batch_.Resize(kS, kA, kB);
  batch_.s = RandomMat(kS, kB, rng_);
  const int K = algo_->NumOptions();
  batch_.o = RandomOptions(kB, K, rng_);
  batch_.o_prev = RandomOptions(kB, K, rng_);
  for (int b = 0; b < kB; ++b) batch_.init[std::size_t(b)] = b % 3 == 1;
  fixed_.o = RandomOptions(kB, K, rng_);
  const Switches& sw = setup_.switches;
  if (Option2Vec() && sw.o2v_dropout > 0) {
    const Index n = kB * (Released(sw.o2v_query) ? 2 : 1);
    for (const Index rows : {Index(setup_.heads * kK), Index(kD), Index(kF), Index(kD)}) {
      Mat keep = Mat::Ones(rows, n);
      for (double& k : keep.reshaped()) k = rng_.Uniform() < sw.o2v_dropout ? 0 : 1;
      fixed_.dropout.push_back(keep);
    }
  }

  // What the network says, so that old log-probabilities and targets can be put where they are
  // wanted.
  const std::vector<int>& fed =
      Option2Vec() && Released(sw.o2v_option_in_update) ? fixed_.o : batch_.o;
  Mat mu, sigma, q;
  algo_->ActionPolicy(batch_.s, fed, mu, sigma);
  algo_->OptionValues(batch_.s, fed, q);
  batch_.a = mu + sigma.cwiseProduct(RandomMat(kA, kB, rng_));
  Vec logp;
  GaussianLogProb(batch_.a, mu, sigma, logp);
  OptionPass pass;
  if (Option2Vec()) pass = Options(Named("embed.W_o").value);
  constexpr double kRatios[] = {0.6, 0.9, 1.1, 1.5};  // outside and inside 1 -+ 0.2
  for (int b = 0; b < kB; ++b) {
    const std::size_t i = std::size_t(b);
    const auto fill = [&](Stream& stream, double log_prob, double value) {
      stream.logp_old(b) = log_prob - std::log(kRatios[b % 4] * rng_.Uniform(0.98, 1.02));
      stream.adv_hat(b) = (b / 4 % 2 ? -1 : 1) * rng_.Uniform(0.5, 2);
      stream.ret(b) = value + rng_.Uniform(0.2, 0.5);
    };
    fill(batch_.low, logp(b), q(K == 1 ? 0 : fed[i], b));
    if (Option2Vec()) fill(batch_.high, pass.log_P(batch_.o[i], b), pass.P.col(b).dot(q.col(b)));
  }
  VisitRelus();
}

Param& Problem::Named(const std::string& name) {
  const auto it =
      std::find_if(params_.begin(), params_.end(), [&](Param* p) { return p->name == name; });
  Check(it != params_.end(), setup_.method, ": no tensor '", name, "'");
  return **it;
}

template <typename Layer>
Layer& Problem::Load(Layer& layer) {
  for (Param* p : layer.Params()) p->value = Named(p->name).value;
  return layer;
}

Mat Problem::Affine(const std::string& name, const Mat& x) {
  return (Named(name + ".W").value * x).colwise() + Named(name + ".b").value.col(0);
}

Mat Problem::Relu(const Mat& z) {
  margin_ = std::min(margin_, ReluMargin(z));
  return z.cwiseMax(0);
}

void Problem::HiddenLayers(const std::string& body, const Mat& x) {
  Relu(Affine(body + ".1", Relu(Affine(body + ".0", x))));
}

/// The option policy in textbook order, its dropout included. `query_embedding` holds the columns
/// that the query reads; the attention's memory is the network's W_o.
Problem::OptionPass Problem::Options(const Mat& query_embedding) {
  const Switches& sw = setup_.switches;
  const bool two = Released(sw.o2v_query);
  Mat o_hat(kD, kB), x(kD, two ? 2 * kB : kB);
  GatherColumns(query_embedding, batch_.o_prev, o_hat);
  LayerNorm norm(two ? "state.ln" : "query.ln", kD);
  LayerNorm::Cache norm_cache;
  const Mat token = Relu(two ? Affine("state", batch_.s) : Affine("query", Stack(batch_.s, o_hat)));
  Load(norm).Forward(token, norm_cache, x.leftCols(kB));
  if (two) x.rightCols(kB) = o_hat;

  AttentionBlock block("attention", "block", kD, setup_.heads, kF);
  AttentionBlock::Cache cache;
  AttentionBlock::Masks masks;
  MemoryAttention::Memory memory;
  if (!fixed_.dropout.empty()) {
    const double keep = 1 / (1 - sw.o2v_dropout);
    masks = {keep * fixed_.dropout[0], keep * fixed_.dropout[1], keep * fixed_.dropout[2],
             keep * fixed_.dropout[3]};
  }
  Load(block).attention.Project(Named("embed.W_o").value, memory);
  block.Forward(x, memory, fixed_.dropout.empty() ? nullptr : &masks, cache);
  Relu(Affine("block.ffn.0", cache.y));

  Mat z =
      Affine("logits", two ? Stack(cache.out.leftCols(kB), cache.out.rightCols(kB)) : cache.out);
  for (Index b = 0; b < kB; ++b) {
    if (!batch_.init[std::size_t(b)]) continue;
    const Mat z_init = Affine("init.1", Relu(Affine("init.0", batch_.s.col(b))));
    z.col(b) = Released(sw.o2v_init_relu) ? Relu(z_init) : z_init;
  }
  OptionPass pass;
  LogSoftmax(z, pass.log_P, pass.P);
  return pass;
}

/// Takes the inputs of all ReLUs (those of the option policy were taken with its outputs) into
/// margin_.
void Problem::VisitRelus() {
  if (!Option2Vec()) {
    if (setup_.activation == 1) {
      HiddenLayers("actor.body", batch_.s);
      HiddenLayers("critic.body", batch_.s);
    }
    return;
  }
  const Mat& W_o = Named("embed.W_o").value;
  for (const std::vector<int>* o : {&batch_.o, &fixed_.o}) {
    Mat o_hat(kD, kB);
    GatherColumns(W_o, *o, o_hat);
    const Mat x = Stack(batch_.s, o_hat);
    HiddenLayers("action.body", x);
    if (Released(setup_.switches.o2v_critic)) {
      LayerNorm norm("critic.ln", kS + kD);
      LayerNorm::Cache cache;
      Mat normalised(kS + kD, kB);
      Load(norm).Forward(x, cache, normalised);
      HiddenLayers("critic.body", normalised);
    }
  }
  if (!Released(setup_.switches.o2v_critic)) {
    for (int k = 0; k < kK; ++k) {
      HiddenLayers("critic.body", Stack(batch_.s, W_o.col(k).replicate(1, kB)));
    }
  }
}

/// L_o as a function of W_o: q is held constant, since the critic's o_hat is detached; so are,
/// where the switches say so, P in the value loss and the query's o_hat (`base`, W_o: the
/// unperturbed ones).
double Problem::OptionObjective(const OptionPass& base, const Mat& W_o, const Mat& q) {
  LossTerms terms;
  const Switches& sw = setup_.switches;
  const OptionPass now = Options(Released(sw.o2v_prev_embed_grad) ? W_o : Named("embed.W_o").value);
  const Mat& P = Released(sw.o2v_vloss_policy) ? now.P : base.P;
  Vec logp(kB), v(kB), H, scratch;
  for (Index b = 0; b < kB; ++b) {
    logp(b) = now.log_P(batch_.o[std::size_t(b)], b);
    v(b) = P.col(b).dot(q.col(b));
  }
  ClippedSurrogate(logp, batch_.high.logp_old, batch_.high.adv_hat, kClip, terms, scratch);
  ValueLoss(v, batch_.high.ret, terms, scratch);
  CategoricalEntropy(now.log_P, now.P, H);
  terms.entropy = H.mean();
  return terms.surrogate - kEntropyWeight * terms.entropy + terms.value;
}

/// Which tensors a stage must leave alone. High (option stage): the action policy and the LayerNorm
/// that nobody uses; the key bias only shifts the attention's logits. Low (action stage):
/// everything but action policy and critic, W_o above all, since o_hat is detached. PPO: none.
Expect Problem::Expected(int stage, const std::string& name) const {
  if (!Option2Vec()) return Expect::kGradient;
  const bool action = name.starts_with("action."), critic = name.starts_with("critic.");
  if (stage == 1) return action || critic ? Expect::kGradient : Expect::kDetached;
  if (action || name.starts_with("unused.")) return Expect::kDetached;
  return name == "attention.in.bk" ? Expect::kShift : Expect::kGradient;
}

/// The stage's loss as a function of a tensor. With `o2v_vloss_policy` = paper the value loss holds
/// P constant, so that no tensor of the option policy moves it.
std::function<double()> Problem::LossOf(int stage, const std::string& name, const Batch& batch,
                                        const FixedDraws& fixed) {
  const bool detached = Option2Vec() && stage == 0 && !name.starts_with("critic.") &&
                        !Released(setup_.switches.o2v_vloss_policy);
  return [this, stage, detached, &batch, &fixed] {
    const LossTerms terms = algo_->Loss(stage, batch, &fixed);
    return detached ? terms.total - terms.value : terms.total;
  };
}

Comparison Problem::Whole(int stage) {
  ZeroGrad(params_);
  const LossTerms terms = algo_->Loss(stage, batch_, &fixed_);
  const std::vector<char> in_graph = algo_->InGraph(stage);
  OptionPass base;
  Mat W_o, q;
  std::function<double()> objective;
  if (Option2Vec() && stage == 0) {
    W_o = Named("embed.W_o").value;
    base = Options(W_o);
    algo_->OptionValues(batch_.s,
                        Released(setup_.switches.o2v_option_in_update) ? fixed_.o : batch_.o, q);
    objective = [&] { return OptionObjective(base, W_o, q); };
    const double total = objective();
    Check(std::abs(total - terms.total) < 1e-12, "option stage: the loss is ", terms.total,
          ", from the outputs ", total);
  }
  std::vector<Slot> slots;
  for (std::size_t i = 0; i < params_.size(); ++i) {
    Param& p = *params_[i];
    const Expect expect = Expected(stage, p.name);
    Check(bool(in_graph[i]) == (expect != Expect::kDetached), p.name, ": InGraph says ",
          int(in_graph[i]));
    slots.emplace_back(p.name, p.value, p.grad,
                       p.name == "embed.W_o" ? objective : LossOf(stage, p.name, batch_, fixed_),
                       expect);
  }
  return Compare(slots, rng_, kEntries);
}

Comparison Problem::Outputs(int stage) {
  Comparison all;
  for (int b = 0; b < kB; ++b) {
    Batch sample;
    Gather(batch_, std::vector<int>{b}, sample);
    FixedDraws fixed{{fixed_.o[std::size_t(b)]}, {}};
    for (const Mat& keep : fixed_.dropout) {
      Mat& column = fixed.dropout.emplace_back(keep.rows(), keep.cols() / kB);
      for (Index token = 0; token < column.cols(); ++token) {
        column.col(token) = keep.col(token * kB + b);
      }
    }
    std::vector<std::string> outputs = {"actor.head.b", "actor.rho", "critic.v.b"};
    if (Option2Vec()) {
      outputs = {stage == 1                         ? "action.mu.b"
                 : batch_.init[std::size_t(b)] != 0 ? "init.1.b"
                                                    : "logits.b",
                 "critic.q.b"};
      if (stage == 1) outputs.push_back("action.sigma.b");
    }
    ZeroGrad(params_);
    algo_->Loss(stage, sample, &fixed);
    std::vector<Slot> slots;
    for (const std::string& name : outputs) {
      Param& p = Named(name);
      slots.emplace_back(name, p.value, p.grad, LossOf(stage, name, sample, fixed));
    }
    Merge(Compare(slots, rng_), all);
  }
  return all;
}

/// A problem without a ReLU input near its kink: the first of the seeds 1, 2, ...
std::unique_ptr<Problem> MakeProblem(const Setup& setup) {
  for (std::uint64_t seed = 1;; ++seed) {
    auto problem = std::make_unique<Problem>(setup, seed);
    if (problem->Margin() >= kReluMargin) return problem;
  }
}

void AddChecks(const std::string& name, const Setup& setup, std::vector<NamedCheck>& checks) {
  const std::vector<std::string> stages = setup.method == "ppo"
                                              ? std::vector<std::string>{"all"}
                                              : std::vector<std::string>{"high", "low"};
  for (int stage = 0; stage < int(stages.size()); ++stage) {
    const std::string full = setup.method + " " + stages[std::size_t(stage)] + " " + name;
    checks.push_back({full, [=] { return MakeProblem(setup)->Whole(stage); }});
    checks.push_back({full + " outputs", [=] { return MakeProblem(setup)->Outputs(stage); }});
  }
}

/// The other setting of a switch.
std::string Flipped(const SwitchInfo& info, Fidelity fidelity) {
  if (info.flag) return "on";
  return fidelity == Fidelity::kPaper ? "released" : "paper";
}

}  // namespace

std::vector<NamedCheck> AlgoChecks() {
  std::vector<NamedCheck> checks;
  for (const std::string method : {"ppo", "option2vec"}) {
    for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
      const Setup plain{method, SwitchesFor(fidelity)};
      AddChecks(ToString(fidelity), plain, checks);
      for (const SwitchInfo& info : SwitchRegistry()) {
        if (!info.Concerns(method)) continue;
        Setup setup = plain;
        const std::string value = Flipped(info, fidelity);
        SetSwitch(setup.switches, method, info.name, value);
        AddChecks(ToString(fidelity) + " " + info.name + "=" + value, setup, checks);
      }
      if (method == "ppo") {
        Setup setup = plain;
        setup.activation = 1;
        AddChecks(ToString(fidelity) + " relu", setup, checks);
        continue;
      }
      for (const int heads : {2, 3}) {
        Setup setup = plain;
        setup.heads = heads;
        AddChecks(ToString(fidelity) + " heads=" + std::to_string(heads), setup, checks);
      }
    }
  }
  Rng rng(20, "gradcheck.switches");
  for (int i = 0; i < 20; ++i) {  // spec 10: 20 seeded random combinations
    Setup setup{"option2vec", SwitchesFor(Fidelity::kPaper)};
    for (const SwitchInfo& info : SwitchRegistry()) {
      if (info.Concerns(setup.method) && rng.Uniform() < 0.5) {
        SetSwitch(setup.switches, setup.method, info.name, Flipped(info, Fidelity::kPaper));
      }
    }
    setup.heads = 1 + int(rng.Below(3));
    AddChecks("random switches " + std::to_string(i), setup, checks);
  }
  return checks;
}

std::vector<NamedCheck> AllChecks() {
  std::vector<NamedCheck> all = NnChecks();
  for (const auto& more : {DistChecks(), AlgoChecks()}) {
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

}  // namespace o2v
