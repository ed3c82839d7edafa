#include <algorithm>
#include <cmath>
#include <limits>

#include "algo/algorithm.h"
#include "algo/option_nets.h"
#include "algo/option_policy.h"
#include "algo/ppo_core.h"
#include "algo/surrogate.h"
#include "dist/categorical.h"
#include "dist/diag_gaussian.h"

namespace o2v {
namespace {

/// AHP+PPO: PPO on the augmented hierarchical policy, whose one action is (b, o, a): stop the
/// previous option or not, the option executed, the action.
///
///   b ~ Bernoulli(beta_{o'}(s)), b = 1 at first states;  o ~ pi(. | s) if b, else o = o'
///   p = [b beta_{o'} + (1-b)(1-beta_{o'})] [b pi_o + (1-b)] pi_o(a | s)
///   L = clip-surrogate(ln p) + 1/2 mean (u_{o'}(s) - R)^2
///
/// u has K + 1 entries, the last one for first states. No entropy term: the authors' weight is
/// never read. Source: spec 4.4; Levy & Shimkin 2011.
class AhpPpo final : public Algorithm {
 public:
  explicit AhpPpo(const AlgorithmInput& in);

  void Collect(VecEnv& env, std::vector<Episode>& episodes) override;
  void Update(std::vector<double>& stats) override;
  std::vector<std::string> StatNames() const override;
  std::vector<Param*> Params() override { return nets_.Params(); }
  void Visit(StateVisitor& v) override;

  int NumOptions() const override { return int(K_); }
  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override;
  void ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) override;
  void OptionValues(const Mat& s, const std::vector<int>& o, Mat& q) override;

  std::vector<std::string> Stages() const override { return {"all"}; }
  LossTerms Loss(int stage, const Batch& batch, const FixedDraws* fixed) override;
  double Step(int stage) override;
  std::vector<char> InGraph(int) const override { return in_graph_; }

 private:
  struct Cache {
    Net::Cache master, critic;  // logits z (K, B); u (K + 1, B)
    OptionNets::BetaCache beta;
    OptionPolicies::Cache policy;
    Mat log_pi, pi;                     // (K, B)
    std::vector<int> o;                 // (B)
    std::vector<char> stop;             // (B) b
    Vec logp, dlogp, log_slope, v, dv;  // (B)
  };

  /// ln p without its Gaussian factor for samples (stop, o), added to logp (B). x (B): the option
  /// whose termination enters, c.beta evaluated for it.
  void AddLogAugmented(std::span<const char> stop, std::span<const int> o, std::span<const int> x,
                       std::span<const char> init, const Cache& c, Vec& logp) const;
  /// Whether the factor of the termination enters at a state.
  bool Terminates(char init) const {
    return !init || switches_.ahp_init_factor == Fidelity::kReleased;
  }
  /// Entry of u that values (s, o').
  Index Entry(int o_prev, char init) const { return init ? K_ : o_prev; }

  const PpoHyper hyper_;
  const Switches switches_;
  const Index K_;
  const int N_;
  Rng policy_rng_, shuffle_rng_;
  OptionNets nets_;
  std::unique_ptr<Adam> adam_;
  std::vector<char> in_graph_;

  Batch rollout_;  // T N samples
  MatD mask_;      // (N, T)
  CriticStream critic_;
  std::vector<int> o_prev_;  // (N)
  CacheByWidth<Cache> caches_;
  Mat a_;  // (A, N)
  Transition transition_;
  Minibatches minibatches_;
  OptionUsage usage_;
  LossMeans means_;
};

AhpPpo::AhpPpo(const AlgorithmInput& in)
    : hyper_(*in.hyper),
      switches_(in.switches),
      K_(in.hyper->Int("options", 1)),
      N_(in.workers),
      policy_rng_(in.seed, "policy"),
      shuffle_rng_(in.seed, "shuffle"),
      critic_(in.workers, hyper_.rollout),
      minibatches_(Index(in.workers) * hyper_.rollout),
      usage_(K_) {
  Rng init(in.seed, "init");
  nets_ = OptionNets(K_, in.S, in.A, in.hyper->Int("hidden", 1), ReadActivation(*in.hyper),
                     OptionNets::CriticHead::kU, init);
  const std::vector<Param*> params = Params();
  for (const Param* p : params) in_graph_.push_back(!p->name.starts_with("critic.q."));
  adam_ = std::make_unique<Adam>(params, hyper_.adam);

  const Index n = Index(N_) * hyper_.rollout;
  rollout_.Resize(in.S, in.A, n);
  rollout_.stop.assign(std::size_t(n), 0);
  mask_ = MatD::Ones(N_, hyper_.rollout);
  o_prev_.assign(std::size_t(N_), 0);
}

void AhpPpo::Visit(StateVisitor& v) {
  for (Param* p : Params()) v.Matrix(p->name, p->value);
  adam_->Visit(v);
  policy_rng_.Visit(v, "rng.policy");
  shuffle_rng_.Visit(v, "rng.shuffle");
  v.Ints("o_prev", o_prev_);
}

void AhpPpo::AddLogAugmented(std::span<const char> stop, std::span<const int> o,
                             std::span<const int> x, std::span<const char> init, const Cache& c,
                             Vec& logp) const {
  for (Index b = 0; b < logp.size(); ++b) {
    const std::size_t i = std::size_t(b);
    if (Terminates(init[i])) {
      const Real beta = c.beta.beta(x[i], b);
      // A saturated sigmoid leaves a large, finite logarithm.
      logp(b) += std::log(std::max(stop[i] ? beta : 1 - beta, std::numeric_limits<Real>::min()));
    }
    if (stop[i]) logp(b) += c.log_pi(o[i], b);
  }
}

void AhpPpo::Collect(VecEnv& env, std::vector<Episode>& episodes) {
  nets_.policy.MakeSigma();
  usage_.Clear();
  Cache& c = caches_(N_);
  const Mat &mu = c.policy.nets.out, &sigma = c.policy.sigma;
  c.o.resize(std::size_t(N_));
  c.stop.resize(std::size_t(N_));
  for (int t = 0; t < hyper_.rollout; ++t) {
    const Index column = Index(t) * N_;
    const Mat& s = env.States();
    nets_.master.Forward(s, c.master);
    LogSoftmax(c.master.out, c.log_pi, c.pi);
    nets_.Beta(s, o_prev_, false, c.beta);
    SampleCategorical(c.pi, policy_rng_, c.o);  // candidates
    for (std::size_t i = 0; i < std::size_t(N_); ++i) {
      const double u = policy_rng_.Uniform();
      c.stop[i] = env.Init()[i] || u < double(c.beta.beta(o_prev_[i], Index(i)));
      if (!c.stop[i]) c.o[i] = o_prev_[i];
    }
    nets_.policy.ForwardOne(s, c.o, c.policy);
    SampleGaussian(mu, sigma, policy_rng_, a_);
    GaussianLogProb(a_, mu, sigma, c.logp);
    AddLogAugmented(c.stop, c.o, o_prev_, env.Init(), c, c.logp);
    LogDensity(switches_.density_log_eps, c.logp, c.log_slope);

    rollout_.s.middleCols(column, N_) = s;
    rollout_.a.middleCols(column, N_) = a_;
    rollout_.low.logp_old.segment(column, N_) = c.logp;
    std::copy(c.stop.begin(), c.stop.end(), rollout_.stop.begin() + column);
    RecordOptions(column, c.o, env.Init(), o_prev_, rollout_, usage_);

    env.Step(a_, transition_, episodes);
    critic_.r.col(t) = transition_.r;
    if (RecordEnds(transition_, t, mask_) && switches_.timelimit == Fidelity::kPaper) {
      nets_.critic.Forward(transition_.s_last, c.critic);  // u_{o_t}(s_last); spec 1.3
      for (int i = 0; i < N_; ++i) {
        if (!transition_.TimeLimit(std::size_t(i))) continue;
        critic_.r(i, t) += hyper_.gamma * double(c.critic.out(o_prev_[std::size_t(i)], i));
      }
    }
  }
  // The critic does not act, so its values are taken after the rollout, in blocks.
  ForEachBlock(rollout_.Size(), hyper_.minibatch, [&](Index start, Index n) {
    Net::Cache& block = caches_(n).critic;
    nets_.critic.Forward(rollout_.s.middleCols(start, n), block);
    for (Index b = 0; b < n; ++b) {
      const std::size_t row = std::size_t(start + b);
      critic_.v.data()[row] = double(block.out(Entry(rollout_.o_prev[row], rollout_.init[row]), b));
    }
  });
  nets_.critic.Forward(env.States(), c.critic);
  for (int i = 0; i < N_; ++i) {
    const std::size_t row = std::size_t(i);
    critic_.v(i, hyper_.rollout) = double(c.critic.out(Entry(o_prev_[row], env.Init()[row]), i));
  }
  critic_.Finish(mask_, hyper_, switches_.adv_std_eps, rollout_.low);
}

LossTerms AhpPpo::Loss(int, const Batch& batch, const FixedDraws*) {
  LossTerms terms;
  const Index B = batch.Size();
  Cache& c = caches_(B);
  const Mat &mu = c.policy.nets.out, &sigma = c.policy.sigma;
  // The option whose termination enters: o_{t-1}, or by the switch o_t.
  const std::vector<int>& x = switches_.ahp_beta_index == Fidelity::kPaper ? batch.o_prev : batch.o;
  nets_.policy.MakeSigma();
  nets_.master.Forward(batch.s, c.master);
  LogSoftmax(c.master.out, c.log_pi, c.pi);
  nets_.Beta(batch.s, x, false, c.beta);
  nets_.policy.ForwardOne(batch.s, batch.o, c.policy);
  GaussianLogProb(batch.a, mu, sigma, c.logp);
  AddLogAugmented(batch.stop, batch.o, x, batch.init, c, c.logp);
  LogDensity(switches_.density_log_eps, c.logp, c.log_slope);
  ClippedSurrogate(c.logp, batch.low.logp_old, batch.low.adv_hat, hyper_.ratio_clip, terms,
                   c.dlogp);
  terms.entropy = GaussianMeanEntropy(sigma);

  // kappa = dL/dln p:  db_x = kappa (b - beta_x),  dz_j = kappa b (delta_jo - pi_j); spec 4.4 (e)
  c.dlogp.array() *= c.log_slope.array();
  GaussianLogProbGrad(batch.a, mu, sigma, c.dlogp, c.policy.nets.dout, c.policy.dsigma);
  nets_.policy.Backward(batch.s, batch.o, c.policy);
  c.beta.db.setZero(K_, B);
  c.master.dout.setZero(K_, B);
  for (Index b = 0; b < B; ++b) {
    const std::size_t i = std::size_t(b);
    const Real kappa = c.dlogp(b);
    if (Terminates(batch.init[i])) {
      c.beta.db(x[i], b) = kappa * (Real(batch.stop[i]) - c.beta.beta(x[i], b));
    }
    if (batch.stop[i]) {
      c.master.dout.col(b) = -kappa * c.pi.col(b);
      c.master.dout(batch.o[i], b) += kappa;
    }
  }
  nets_.BackwardBeta(batch.s, x, c.beta);
  nets_.master.Backward(batch.s, c.master);

  nets_.critic.Forward(batch.s, c.critic);
  c.v.resize(B);
  for (Index b = 0; b < B; ++b) {
    const std::size_t i = std::size_t(b);
    c.v(b) = c.critic.out(Entry(batch.o_prev[i], batch.init[i]), b);
  }
  ValueLoss(c.v, batch.low.ret, terms, c.dv);
  c.critic.dout.setZero(K_ + 1, B);
  for (Index b = 0; b < B; ++b) {
    const std::size_t i = std::size_t(b);
    c.critic.dout(Entry(batch.o_prev[i], batch.init[i]), b) = c.dv(b);
  }
  nets_.critic.Backward(batch.s, c.critic);
  terms.total = terms.surrogate + terms.value;
  return terms;
}

double AhpPpo::Step(int) { return adam_->Step(in_graph_, IdleRule::kSkip); }

void AhpPpo::Update(std::vector<double>& stats) {
  means_.Clear();
  minibatches_.Run(rollout_, hyper_, shuffle_rng_, [&](const Batch& batch) {
    const LossTerms terms = Loss(0, batch, nullptr);
    means_.Add(terms, Step(0));
  });
  stats.clear();
  means_.Report(stats);
  usage_.Report(stats);
}

std::vector<std::string> AhpPpo::StatNames() const {
  std::vector<std::string> names;
  LossMeans::Names("all", names);
  usage_.Names(names);
  return names;
}

/// P(o | s, o') = (1 - beta_{o'}) delta_{o o'} + beta_{o'} pi_o, as b and the candidate are drawn.
void AhpPpo::OptionPolicy(const Mat& s, const std::vector<int>& o_prev,
                          const std::vector<char>& init, Mat& P) {
  Cache& c = caches_(s.cols());
  nets_.master.Forward(s, c.master);
  LogSoftmax(c.master.out, c.log_pi, c.pi);
  nets_.Beta(s, o_prev, false, c.beta);
  Mat M(K_, s.cols());
  OneHot(o_prev, M);
  CallAndReturn(c.pi, c.beta.beta, M, o_prev, init, Fidelity::kPaper, P);
}

void AhpPpo::ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) {
  Cache& c = caches_(s.cols());
  nets_.policy.MakeSigma();
  nets_.policy.ForwardOne(s, o, c.policy);
  mu = c.policy.nets.out;
  sigma = c.policy.sigma;
}

/// u_k(s), the value after option k; the entry of first states is left out.
void AhpPpo::OptionValues(const Mat& s, const std::vector<int>&, Mat& q) {
  Cache& c = caches_(s.cols());
  nets_.critic.Forward(s, c.critic);
  q = c.critic.out.topRows(K_);
}

}  // namespace

std::unique_ptr<Algorithm> MakeAhpPpo(const AlgorithmInput& in) {
  return std::make_unique<AhpPpo>(in);
}

}  // namespace o2v
