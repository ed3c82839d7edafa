#include <algorithm>
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

/// PPOC: the option-critic with PPO's surrogate on the intra-option policies. One option by
/// call-and-return (beta itself is never sampled), one stream of values q_o.
///
///   L = clip-surrogate(ln pi_o(a | s))
///       + mean beta_{o'}(s) (1 - init) [q_{o'} - sum_k pi_k q_k + eta]      bracket constant
///       + 1/2 mean (q_o - R)^2
///       - mean omega ln pi_o(s) A_hat - w mean H(pi)
///
/// omega: with `ppoc_master_weight` = paper the posterior beta_{o'} pi_o / pi_hat_o that the master
/// chose o (1 at first states), constant in the gradient; released 1. Source: spec 4.2; Klissarov
/// et al. 2017.
class Ppoc final : public Algorithm {
 public:
  explicit Ppoc(const AlgorithmInput& in);

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
    Net::Cache master, critic;               // logits z, q (K, B)
    OptionNets::BetaCache beta, beta_taken;  // of o', or of all options; of o
    OptionPolicies::Cache policy;
    Mat log_pi, pi, M, pi_hat;                             // (K, B)
    std::vector<int> o;                                    // (B)
    Vec logp, dlogp, log_slope, v, dv, H, omega, dlog_pi;  // (B)
  };

  /// Master policy, terminations and pi_hat at s.
  void Options(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init,
               Cache& c) const;
  /// q and an option drawn from pi_hat at s.
  void Evaluate(const Mat& s, std::span<const char> init, Cache& c);
  /// omega (B).
  void MasterWeight(const Batch& batch, Cache& c) const;
  bool AllBetas() const { return switches_.beta_index == Fidelity::kReleased; }

  const PpoHyper hyper_;
  const Switches switches_;
  const Real w_, eta_;
  const Index K_;
  const int N_;
  Rng policy_rng_, bootstrap_rng_, shuffle_rng_;
  OptionNets nets_;
  std::unique_ptr<Adam> adam_;
  std::vector<char> in_graph_;

  Batch rollout_;  // T N samples
  MatD mask_;      // (N, T)
  CriticStream critic_;
  std::vector<int> o_prev_;        // (N)
  std::vector<char> not_initial_;  // (N) zeros
  CacheByWidth<Cache> caches_;
  Mat a_;  // (A, N)
  Transition transition_;
  Minibatches minibatches_;
  OptionUsage usage_;
  LossMeans means_;
};

Ppoc::Ppoc(const AlgorithmInput& in)
    : hyper_(*in.hyper),
      switches_(in.switches),
      w_(Real(in.hyper->Real("entropy_weight"))),
      eta_(Real(in.hyper->Real("termination_penalty"))),
      K_(in.hyper->Int("options", 1)),
      N_(in.workers),
      policy_rng_(in.seed, "policy"),
      bootstrap_rng_(in.seed, "bootstrap"),
      shuffle_rng_(in.seed, "shuffle"),
      critic_(in.workers, hyper_.rollout),
      minibatches_(Index(in.workers) * hyper_.rollout),
      usage_(K_) {
  Rng init(in.seed, "init");
  nets_ = OptionNets(K_, in.S, in.A, in.hyper->Int("hidden", 1), ReadActivation(*in.hyper),
                     OptionNets::CriticHead::kQ, init);
  const std::vector<Param*> params = Params();
  for (const Param* p : params) in_graph_.push_back(!p->name.starts_with("critic.u."));
  adam_ = std::make_unique<Adam>(params, hyper_.adam);

  rollout_.Resize(in.S, in.A, Index(N_) * hyper_.rollout);
  mask_ = MatD::Ones(N_, hyper_.rollout);
  o_prev_.assign(std::size_t(N_), 0);
  not_initial_.assign(std::size_t(N_), 0);
}

void Ppoc::Visit(StateVisitor& v) {
  for (Param* p : Params()) v.Matrix(p->name, p->value);
  adam_->Visit(v);
  policy_rng_.Visit(v, "rng.policy");
  bootstrap_rng_.Visit(v, "rng.bootstrap");
  shuffle_rng_.Visit(v, "rng.shuffle");
  v.Ints("o_prev", o_prev_);
}

// ---- Rollout ------------------------------------------------------------------------------------

void Ppoc::Options(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init,
                   Cache& c) const {
  nets_.master.Forward(s, c.master);
  LogSoftmax(c.master.out, c.log_pi, c.pi);
  nets_.Beta(s, o_prev, AllBetas(), c.beta);
  c.M.resize(K_, s.cols());
  OneHot(o_prev, c.M);
  CallAndReturn(c.pi, c.beta.beta, c.M, o_prev, init, switches_.beta_index, c.pi_hat);
}

void Ppoc::Evaluate(const Mat& s, std::span<const char> init, Cache& c) {
  Options(s, o_prev_, init, c);
  SampleCategorical(c.pi_hat, bootstrap_rng_, c.o);
  nets_.critic.Forward(s, c.critic);
}

void Ppoc::Collect(VecEnv& env, std::vector<Episode>& episodes) {
  nets_.policy.MakeSigma();
  usage_.Clear();
  Cache& c = caches_(N_);
  const Mat &mu = c.policy.nets.out, &sigma = c.policy.sigma, &q = c.critic.out;
  c.o.resize(std::size_t(N_));
  for (int t = 0; t < hyper_.rollout; ++t) {
    const Index column = Index(t) * N_;
    const Mat& s = env.States();
    Options(s, o_prev_, env.Init(), c);
    SampleCategorical(c.pi_hat, policy_rng_, c.o);
    nets_.policy.ForwardOne(s, c.o, c.policy);
    SampleGaussian(mu, sigma, policy_rng_, a_);
    GaussianLogProb(a_, mu, sigma, c.logp);
    LogDensity(switches_.density_log_eps, c.logp, c.log_slope);

    rollout_.s.middleCols(column, N_) = s;
    rollout_.a.middleCols(column, N_) = a_;
    rollout_.low.logp_old.segment(column, N_) = c.logp;
    RecordOptions(column, c.o, env.Init(), o_prev_, rollout_, usage_);

    env.Step(a_, transition_, episodes);
    critic_.r.col(t) = transition_.r;
    if (RecordEnds(transition_, t, mask_) && switches_.timelimit == Fidelity::kPaper) {
      Evaluate(transition_.s_last, not_initial_, c);  // q_o, o ~ pi_hat(. | s_last, o_t); spec 1.3
      for (int i = 0; i < N_; ++i) {
        if (!transition_.TimeLimit(std::size_t(i))) continue;
        critic_.r(i, t) += hyper_.gamma * double(q(c.o[std::size_t(i)], i));
      }
    }
  }
  // The critic does not act, so its values are taken after the rollout, in blocks.
  ForEachBlock(rollout_.Size(), hyper_.minibatch, [&](Index start, Index n) {
    Net::Cache& block = caches_(n).critic;
    nets_.critic.Forward(rollout_.s.middleCols(start, n), block);
    for (Index b = 0; b < n; ++b) {
      critic_.v.data()[start + b] = double(block.out(rollout_.o[std::size_t(start + b)], b));
    }
  });
  // v_T: one more pass; the option that it draws is thrown away (spec 1.3).
  Evaluate(env.States(), env.Init(), c);
  for (int i = 0; i < N_; ++i) {
    critic_.v(i, hyper_.rollout) = double(q(c.o[std::size_t(i)], i));
  }
  critic_.Finish(mask_, hyper_, switches_.adv_std_eps, rollout_.low);
}

// ---- Loss and update ----------------------------------------------------------------------------

void Ppoc::MasterWeight(const Batch& batch, Cache& c) const {
  c.omega.setOnes(batch.Size());
  if (switches_.ppoc_master_weight == Fidelity::kReleased) return;
  if (AllBetas()) nets_.Beta(batch.s, batch.o, false, c.beta_taken);
  for (Index b = 0; b < batch.Size(); ++b) {
    const std::size_t i = std::size_t(b);
    if (batch.init[i]) continue;
    const int o = batch.o[i], o_prev = batch.o_prev[i];
    const Real stop = c.beta.beta(o_prev, b), pi = c.pi(o, b);
    const Real beta = AllBetas() ? c.beta_taken.beta(o, b) : stop;  // of the entry o of pi_hat
    const Real pi_hat = (1 - beta) * Real(o == o_prev) + beta * pi;
    // Against 0 / 0 where terminations saturate.
    c.omega(b) = stop * pi / std::max(pi_hat, std::numeric_limits<Real>::min());
  }
}

LossTerms Ppoc::Loss(int, const Batch& batch, const FixedDraws*) {
  LossTerms terms;
  const Index B = batch.Size();
  const Real scale = Real(1) / Real(B);
  Cache& c = caches_(B);
  const Mat &mu = c.policy.nets.out, &sigma = c.policy.sigma, &q = c.critic.out;
  nets_.policy.MakeSigma();
  nets_.policy.ForwardOne(batch.s, batch.o, c.policy);
  GaussianLogProb(batch.a, mu, sigma, c.logp);
  LogDensity(switches_.density_log_eps, c.logp, c.log_slope);
  ClippedSurrogate(c.logp, batch.low.logp_old, batch.low.adv_hat, hyper_.ratio_clip, terms,
                   c.dlogp);
  c.dlogp.array() *= c.log_slope.array();
  GaussianLogProbGrad(batch.a, mu, sigma, c.dlogp, c.policy.nets.dout, c.policy.dsigma);
  nets_.policy.Backward(batch.s, batch.o, c.policy);

  nets_.critic.Forward(batch.s, c.critic);
  c.v.resize(B);
  for (Index b = 0; b < B; ++b) c.v(b) = q(batch.o[std::size_t(b)], b);
  ValueLoss(c.v, batch.low.ret, terms, c.dv);
  c.critic.dout.setZero(K_, B);
  for (Index b = 0; b < B; ++b) c.critic.dout(batch.o[std::size_t(b)], b) = c.dv(b);
  nets_.critic.Backward(batch.s, c.critic);

  // Terminations: only beta_{o'} moves.
  nets_.master.Forward(batch.s, c.master);
  LogSoftmax(c.master.out, c.log_pi, c.pi);
  nets_.Beta(batch.s, batch.o_prev, false, c.beta);
  c.beta.db.setZero(K_, B);
  for (Index b = 0; b < B; ++b) {
    const std::size_t i = std::size_t(b);
    if (batch.init[i]) continue;
    const int o_prev = batch.o_prev[i];
    const Real beta = c.beta.beta(o_prev, b);
    const Real regret = scale * (q(o_prev, b) - c.pi.col(b).dot(q.col(b)) + eta_);
    terms.termination += double(beta * regret);
    c.beta.db(o_prev, b) = regret * beta * (1 - beta);
  }
  nets_.BackwardBeta(batch.s, batch.o_prev, c.beta);

  // Master policy: dz_j = -(omega A / B)(delta_jo - pi_j) + (w / B) pi_j (ln pi_j + H); spec 4.2
  // (e)
  MasterWeight(batch, c);
  c.dlog_pi = -scale * c.omega.cwiseProduct(batch.low.adv_hat);
  for (Index b = 0; b < B; ++b) {
    terms.master += double(c.dlog_pi(b) * c.log_pi(batch.o[std::size_t(b)], b));
  }
  CategoricalEntropy(c.log_pi, c.pi, c.H);
  terms.entropy = double(c.H.sum()) / double(B);
  c.master.dout.setZero(K_, B);
  AddLogProbGrad(c.pi, batch.o, c.dlog_pi, c.master.dout);
  AddEntropyGrad(c.log_pi, c.pi, c.H, -w_ * scale, c.master.dout);
  nets_.master.Backward(batch.s, c.master);

  terms.total =
      terms.surrogate + terms.termination + terms.value + terms.master - double(w_) * terms.entropy;
  return terms;
}

double Ppoc::Step(int) { return adam_->Step(in_graph_, IdleRule::kSkip); }

void Ppoc::Update(std::vector<double>& stats) {
  means_.Clear();
  minibatches_.Run(rollout_, hyper_, shuffle_rng_, [&](const Batch& batch) {
    const LossTerms terms = Loss(0, batch, nullptr);
    means_.Add(terms, Step(0));
  });
  stats.clear();
  means_.Report(stats);
  usage_.Report(stats);
}

std::vector<std::string> Ppoc::StatNames() const {
  std::vector<std::string> names;
  LossMeans::Names("all", names);
  usage_.Names(names);
  return names;
}

// ---- Queries ------------------------------------------------------------------------------------

void Ppoc::OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                        Mat& P) {
  Cache& c = caches_(s.cols());
  Options(s, o_prev, init, c);
  P = c.pi_hat;
  for (Index b = 0; b < P.cols(); ++b) P.col(b) /= P.col(b).sum();
}

void Ppoc::ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) {
  Cache& c = caches_(s.cols());
  nets_.policy.MakeSigma();
  nets_.policy.ForwardOne(s, o, c.policy);
  mu = c.policy.nets.out;
  sigma = c.policy.sigma;
}

void Ppoc::OptionValues(const Mat& s, const std::vector<int>&, Mat& q) {
  Cache& c = caches_(s.cols());
  nets_.critic.Forward(s, c.critic);
  q = c.critic.out;
}

}  // namespace

std::unique_ptr<Algorithm> MakePpoc(const AlgorithmInput& in) { return std::make_unique<Ppoc>(in); }

}  // namespace o2v
