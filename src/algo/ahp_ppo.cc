#include <algorithm>
#include <cmath>
#include <limits>

#include "algo/option_policy.h"
#include "algo/ppo_method.h"
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
class AhpPpo final : public PpoMethod {
 public:
  explicit AhpPpo(const AlgorithmInput& in);

  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override;
  LossTerms Loss(int stage, const Batch& batch, const FixedDraws* fixed) override;

 private:
  void Act(const Mat& s, std::span<const char> init, Index first) override;
  void Values(const Choices& x, Index first) override;

  struct Cache {
    OptionNets::CallAndReturnCache options;
    ActionCache action;      // action.logp is ln p
    ValueCache value;        // value.critic.out is u (K + 1, B)
    std::vector<int> o;      // (B)
    std::vector<char> stop;  // (B) b
    std::vector<int> entry;  // (B) of u
  };

  /// ln p without its Gaussian factor for samples (stop, o), added to logp (B). x (B): the option
  /// whose termination enters, evaluated in c.
  void AddLogAugmented(std::span<const char> stop, std::span<const int> o, std::span<const int> x,
                       std::span<const char> init, const OptionNets::CallAndReturnCache& c,
                       Vec& logp) const;
  /// Its adjoints, from dlogp (B).
  void AugmentedBackward(const Batch& batch, std::span<const int> x, const Vec& dlogp,
                         OptionNets::CallAndReturnCache& c);
  /// Whether the factor of the termination enters at a state.
  bool Terminates(char init) const {
    return !init || switches_.ahp_init_factor == Fidelity::kReleased;
  }
  /// Entries of u that value (s, o').
  void Entries(std::span<const int> o_prev, std::span<const char> init,
               std::vector<int>& entry) const;

  const double clip_;  // c
  OptionNets nets_;
  CacheByWidth<Cache> caches_;
};

AhpPpo::AhpPpo(const AlgorithmInput& in)
    : PpoMethod(in, in.hyper->Int("options", 1)), clip_(in.hyper->Real("ratio_clip")) {
  nets_ = MakeOptionNets(in, OptionNets::CriticHead::kU, initialiser_);
  RegisterNetworks(in, nets_.Params(), {nets_.UsedParams()}, &nets_.policy, &nets_.critic);
  rollout_.batch.stop.assign(std::size_t(rollout_.batch.Size()), 0);
  o_prev_.assign(std::size_t(N_), 0);
}

void AhpPpo::Entries(std::span<const int> o_prev, std::span<const char> init,
                     std::vector<int>& entry) const {
  entry.resize(o_prev.size());
  for (std::size_t i = 0; i < entry.size(); ++i) entry[i] = init[i] ? int(K_) : o_prev[i];
}

void AhpPpo::AddLogAugmented(std::span<const char> stop, std::span<const int> o,
                             std::span<const int> x, std::span<const char> init,
                             const OptionNets::CallAndReturnCache& c, Vec& logp) const {
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

/// kappa = dL/dln p:  db_x = kappa (b - beta_x),  dz_j = kappa b (delta_jo - pi_j); spec 4.4 (e)
void AhpPpo::AugmentedBackward(const Batch& batch, std::span<const int> x, const Vec& dlogp,
                               OptionNets::CallAndReturnCache& c) {
  Mat &db = c.beta.db, &dz = c.master.dout;
  db.setZero(K_, batch.Size());
  dz.setZero(K_, batch.Size());
  for (Index b = 0; b < batch.Size(); ++b) {
    const std::size_t i = std::size_t(b);
    const Real kappa = dlogp(b);
    if (Terminates(batch.init[i])) {
      db(x[i], b) = kappa * (Real(batch.stop[i]) - c.beta.beta(x[i], b));
    }
    if (batch.stop[i]) {
      dz.col(b) = -kappa * c.pi.col(b);
      dz(batch.o[i], b) += kappa;
    }
  }
  nets_.BackwardBeta(batch.s, x, c.beta);
  nets_.master.Backward(batch.s, c.master);
}

void AhpPpo::Act(const Mat& s, std::span<const char> init, Index first) {
  Batch& batch = rollout_.batch;
  Cache& c = caches_(N_);
  c.o.resize(std::size_t(N_));
  c.stop.resize(std::size_t(N_));
  nets_.Master(s, c.options);
  nets_.Beta(s, o_prev_, false, c.options.beta);
  SampleCategorical(c.options.pi, policy_rng_, c.o);  // candidates
  for (std::size_t i = 0; i < std::size_t(N_); ++i) {
    const double u = policy_rng_.Uniform();
    c.stop[i] = init[i] || u < double(c.options.beta.beta(o_prev_[i], Index(i)));
    if (!c.stop[i]) c.o[i] = o_prev_[i];
  }
  SampleAction(nets_.policy, s, c.o, policy_rng_, a_, c.action);
  AddLogAugmented(c.stop, c.o, o_prev_, init, c.options, c.action.logp);
  LogDensity(switches_.density_log_eps, c.action.logp, c.action.slope);
  batch.action.logp_old.segment(first, N_) = c.action.logp;
  std::copy(c.stop.begin(), c.stop.end(), batch.stop.begin() + first);
  RecordOptions(first, c.o, init, batch);
}

/// v = u_{o'}.
void AhpPpo::Values(const Choices& x, Index first) {
  Cache& c = caches_(x.s.cols());
  Entries(x.o_prev, x.init, c.entry);
  EntryValues(nets_.critic, x.s, c.entry, c.value.critic, rollout_.critics[0].v.data() + first);
}

LossTerms AhpPpo::Loss(int, const Batch& batch, const FixedDraws*) {
  LossTerms terms;
  Cache& c = caches_(batch.Size());
  // The option whose termination enters: o_{t-1}, or by the switch o_t.
  const std::vector<int>& x = switches_.ahp_beta_index == Fidelity::kPaper ? batch.o_prev : batch.o;
  nets_.Master(batch.s, c.options);
  nets_.Beta(batch.s, x, false, c.options.beta);
  ActionLogProb(nets_.policy, batch, c.action);
  AddLogAugmented(batch.stop, batch.o, x, batch.init, c.options, c.action.logp);
  ActionSurrogate(nets_.policy, batch, switches_.density_log_eps, clip_, terms, c.action);
  terms.entropy = GaussianMeanEntropy(c.action.policy.sigma);
  AugmentedBackward(batch, x, c.action.dlogp, c.options);

  Entries(batch.o_prev, batch.init, c.entry);
  EntryValueLoss(nets_.critic, batch.s, c.entry, batch.action.ret, terms, c.value);
  terms.total = terms.surrogate + terms.value;
  return terms;
}

/// P(o | s, o') = (1 - beta_{o'}) delta_{o o'} + beta_{o'} pi_o, as b and the candidate are drawn.
void AhpPpo::OptionPolicy(const Mat& s, const std::vector<int>& o_prev,
                          const std::vector<char>& init, Mat& P) {
  OptionNets::CallAndReturnCache& c = caches_(s.cols()).options;
  nets_.Master(s, c);
  nets_.CallAndReturn(s, o_prev, init, c.pi, Fidelity::kPaper, c);
  P = c.pi_hat;
}

}  // namespace

std::unique_ptr<Algorithm> MakeAhpPpo(const AlgorithmInput& in) {
  return std::make_unique<AhpPpo>(in);
}

}  // namespace o2v
