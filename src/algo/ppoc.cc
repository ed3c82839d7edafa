#include <algorithm>
#include <limits>

#include "algo/option_policy.h"
#include "algo/ppo_method.h"
#include "dist/categorical.h"

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
class Ppoc final : public PpoMethod {
 public:
  explicit Ppoc(const AlgorithmInput& in);

  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override;
  LossTerms Loss(int stage, const Batch& batch, const FixedDraws* fixed) override;

 private:
  void Act(const Mat& s, std::span<const char> init, Index first) override;
  Choices DrawForBootstrap(const Mat& s, std::span<const char> init) override;
  void Values(const Choices& x, Index first) override;

  struct Cache {
    OptionNets::CallAndReturnCache options;
    OptionNets::BetaCache beta_taken;  // of o
    ActionCache action;
    ValueCache value;       // value.critic.out is q (K, B)
    std::vector<int> o;     // (B)
    Vec H, omega, dlog_pi;  // (B)
  };

  /// pi_hat at s.
  const Mat& PiHat(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init);
  void TerminationLoss(const Batch& batch, LossTerms& terms, Cache& c);
  void MasterLoss(const Batch& batch, LossTerms& terms, Cache& c);
  /// omega (B).
  void MasterWeight(const Batch& batch, Cache& c) const;
  bool AllBetas() const { return switches_.beta_index == Fidelity::kReleased; }

  const double clip_;  // c
  const Real w_, eta_;
  Rng& bootstrap_rng_ = NewStream("bootstrap");
  OptionNets nets_;
  CacheByWidth<Cache> caches_;
};

Ppoc::Ppoc(const AlgorithmInput& in)
    : PpoMethod(in, in.hyper->Int("options", 1), {"all"},
                {{"termination", &LossTerms::termination}, {"master", &LossTerms::master}}),
      clip_(in.hyper->Real("ratio_clip")),
      w_(Real(in.hyper->Real("entropy_weight"))),
      eta_(Real(in.hyper->Real("termination_penalty"))) {
  nets_ = MakeOptionNets(in, OptionNets::CriticHead::kQ, initialiser_);
  RegisterNetworks(in, nets_.Params(), {nets_.UsedParams()}, &nets_.policy, &nets_.critic);
  o_prev_.assign(std::size_t(N_), 0);
}

const Mat& Ppoc::PiHat(const ConstMatRef& s, std::span<const int> o_prev,
                       std::span<const char> init) {
  OptionNets::CallAndReturnCache& c = caches_(s.cols()).options;
  nets_.Master(s, c);
  nets_.CallAndReturn(s, o_prev, init, c.pi, switches_.beta_index, c);
  return c.pi_hat;
}

void Ppoc::Act(const Mat& s, std::span<const char> init, Index first) {
  Cache& c = caches_(N_);
  c.o.resize(std::size_t(N_));
  SampleCategorical(PiHat(s, o_prev_, init), policy_rng_, c.o);
  SampleAction(nets_.policy, s, c.o, policy_rng_, a_, c.action);
  LogDensity(switches_.density_log_eps, c.action.logp, c.action.slope);
  rollout_.batch.action.logp_old.segment(first, N_) = c.action.logp;
  RecordOptions(first, c.o, init, rollout_.batch);
}

/// o ~ pi_hat(. | s, o').
Choices Ppoc::DrawForBootstrap(const Mat& s, std::span<const char> init) {
  Choices x = PpoMethod::DrawForBootstrap(s, init);
  Cache& c = caches_(N_);
  SampleCategorical(PiHat(s, o_prev_, init), bootstrap_rng_, c.o);
  x.o = c.o;
  return x;
}

/// v = q_o.
void Ppoc::Values(const Choices& x, Index first) {
  EntryValues(nets_.critic, x.s, x.o, caches_(x.s.cols()).value.critic,
              rollout_.critics[0].v.data() + first);
}

LossTerms Ppoc::Loss(int, const Batch& batch, const FixedDraws*) {
  LossTerms terms;
  Cache& c = caches_(batch.Size());
  ActionLogProb(nets_.policy, batch, c.action);
  ActionSurrogate(nets_.policy, batch, switches_.density_log_eps, clip_, terms, c.action);
  EntryValueLoss(nets_.critic, batch.s, batch.o, batch.action.ret, terms, c.value);
  nets_.Master(batch.s, c.options);
  TerminationLoss(batch, terms, c);
  MasterLoss(batch, terms, c);
  terms.total =
      terms.surrogate + terms.termination + terms.value + terms.master - double(w_) * terms.entropy;
  return terms;
}

/// db_{o'} = (1/B) (1 - init) (q_{o'} - sum_k pi_k q_k + eta) beta (1 - beta): only beta_{o'}
/// moves.
void Ppoc::TerminationLoss(const Batch& batch, LossTerms& terms, Cache& c) {
  const Real scale = Real(1) / Real(batch.Size());
  const Mat& q = c.value.critic.out;
  OptionNets::BetaCache& betas = c.options.beta;
  nets_.Beta(batch.s, batch.o_prev, false, betas);
  betas.db.setZero(K_, batch.Size());
  for (Index b = 0; b < batch.Size(); ++b) {
    const std::size_t i = std::size_t(b);
    if (batch.init[i]) continue;
    const int o_prev = batch.o_prev[i];
    const Real beta = betas.beta(o_prev, b);
    const Real regret = scale * (q(o_prev, b) - c.options.pi.col(b).dot(q.col(b)) + eta_);
    terms.termination += double(beta * regret);
    betas.db(o_prev, b) = regret * beta * (1 - beta);
  }
  nets_.BackwardBeta(batch.s, batch.o_prev, betas);
}

/// dz_j = -(omega A / B)(delta_jo - pi_j) + (w / B) pi_j (ln pi_j + H); spec 4.2 (e)
void Ppoc::MasterLoss(const Batch& batch, LossTerms& terms, Cache& c) {
  const Index B = batch.Size();
  const Real scale = Real(1) / Real(B);
  const Mat &pi = c.options.pi, &log_pi = c.options.log_pi;
  Mat& dz = c.options.master.dout;
  MasterWeight(batch, c);
  c.dlog_pi = -scale * c.omega.cwiseProduct(batch.action.adv_hat);
  for (Index b = 0; b < B; ++b) {
    terms.master += double(c.dlog_pi(b) * log_pi(batch.o[std::size_t(b)], b));
  }
  CategoricalEntropy(log_pi, pi, c.H);
  terms.entropy = double(c.H.sum()) / double(B);
  dz.setZero(K_, B);
  AddLogProbGrad(pi, batch.o, c.dlog_pi, dz);
  AddEntropyGrad(log_pi, pi, c.H, -w_ * scale, dz);
  nets_.master.Backward(batch.s, c.options.master);
}

void Ppoc::MasterWeight(const Batch& batch, Cache& c) const {
  c.omega.setOnes(batch.Size());
  if (switches_.ppoc_master_weight == Fidelity::kReleased) return;
  if (AllBetas()) nets_.Beta(batch.s, batch.o, false, c.beta_taken);
  for (Index b = 0; b < batch.Size(); ++b) {
    const std::size_t i = std::size_t(b);
    if (batch.init[i]) continue;
    const int o = batch.o[i], o_prev = batch.o_prev[i];
    const Real stop = c.options.beta.beta(o_prev, b), pi = c.options.pi(o, b);
    const Real beta = AllBetas() ? c.beta_taken.beta(o, b) : stop;  // of the entry o of pi_hat
    const Real pi_hat = (1 - beta) * Real(o == o_prev) + beta * pi;
    // Against 0 / 0 where terminations saturate.
    c.omega(b) = stop * pi / std::max(pi_hat, std::numeric_limits<Real>::min());
  }
}

void Ppoc::OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                        Mat& P) {
  P = PiHat(s, o_prev, init);
  NormalizeColumns(P);
}

}  // namespace

std::unique_ptr<Algorithm> MakePpoc(const AlgorithmInput& in) { return std::make_unique<Ppoc>(in); }

}  // namespace o2v
