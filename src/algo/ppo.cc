#include "algo/ppo_method.h"
#include "dist/diag_gaussian.h"

namespace o2v {
namespace {

/// PPO: proximal policy optimisation with a Gaussian actor and a separate critic.
///
///   mu(s) = tanh(W_mu Body(s) + b),  sigma = softplus(rho) free of the state
///   v(s)  = w_v Body'(s) + b_v
///   L = clip-surrogate(ln N(a; mu, sigma), old, A_hat) - w mean H + 1/2 mean (v - R)^2
///
/// Source: spec 2.2, 4.1; Schulman et al. 2017.
class Ppo final : public PpoMethod {
 public:
  explicit Ppo(const AlgorithmInput& in);

  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override;
  void ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) override;
  LossTerms Loss(int stage, const Batch& batch, const FixedDraws* fixed) override;

 private:
  void Act(const Mat& s, std::span<const char> init, Index first) override;
  void Values(const Choices& x, Index first) override;

  struct Cache {
    Mlp::Cache actor, critic;  // the actor's output is mu (A, B)
    Mat dsigma;                // (A, 1)
    Vec logp, dlogp, values;   // (B)
  };

  /// s (S, B) -> c.actor.out = mu; sigma is in sigma_.
  void Actor(const ConstMatRef& s, Cache& c) const;
  void MakeSigma();  // sigma_ = softplus(rho)

  const double clip_;            // c
  const double entropy_weight_;  // w
  Mlp actor_, critic_net_;
  Param rho_;  // (A, 1)
  Mat sigma_;  // (A, 1)
  CacheByWidth<Cache> caches_;
};

Ppo::Ppo(const AlgorithmInput& in)
    : PpoMethod(in, /*K=*/0),
      clip_(in.hyper->Real("ratio_clip")),
      entropy_weight_(in.hyper->Real("entropy_weight")),
      rho_("actor.rho", in.A, 1) {
  const Index h = in.hyper->Int("hidden", 1);
  const Activation g = ReadActivation(*in.hyper);
  actor_ = Mlp("actor.body", "actor.head", in.S, h, in.A, g, initialiser_);
  critic_net_ = Mlp("critic.body", "critic.v", in.S, h, 1, g, initialiser_);
  std::vector<Param*> params = actor_.Params();
  params.push_back(&rho_);
  Append(params, critic_net_.Params());
  RegisterNetworks(in, params, {params}, nullptr, &critic_net_);
}

void Ppo::MakeSigma() {
  sigma_ = rho_.value;
  Softplus(sigma_);
}

void Ppo::Actor(const ConstMatRef& s, Cache& c) const {
  actor_.Forward(s, c.actor);
  Tanh(c.actor.out);
}

void Ppo::Act(const Mat& s, std::span<const char>, Index first) {
  Cache& c = caches_(N_);
  MakeSigma();
  Actor(s, c);
  SampleGaussian(c.actor.out, sigma_, policy_rng_, a_);
  GaussianLogProb(a_, c.actor.out, sigma_, c.logp);
  rollout_.batch.action.logp_old.segment(first, N_) = c.logp;
}

void Ppo::Values(const Choices& x, Index first) {
  Mlp::Cache& critic = caches_(x.s.cols()).critic;
  critic_net_.Forward(x.s, critic);
  Eigen::Map<VecD>(rollout_.critics[0].v.data() + first, x.s.cols()) =
      critic.out.row(0).transpose().cast<double>();
}

LossTerms Ppo::Loss(int, const Batch& batch, const FixedDraws*) {
  LossTerms terms;
  Cache& c = caches_(batch.Size());
  MakeSigma();
  Actor(batch.s, c);
  const Mat& mu = c.actor.out;
  GaussianLogProb(batch.a, mu, sigma_, c.logp);
  ClippedSurrogate(c.logp, batch.action.logp_old, batch.action.adv_hat, clip_, terms, c.dlogp);
  terms.entropy = GaussianMeanEntropy(sigma_);

  GaussianLogProbGrad(batch.a, mu, sigma_, c.dlogp, c.actor.dout, c.dsigma);
  AddGaussianEntropyGrad(sigma_, Real(-entropy_weight_), c.dsigma);
  SoftplusBackward(sigma_, c.dsigma);
  rho_.grad += c.dsigma;
  ActivationBackward(Activation::kTanh, mu, c.actor.dout);
  actor_.Backward(batch.s, c.actor);

  critic_net_.Forward(batch.s, c.critic);
  c.values = c.critic.out.row(0).transpose();
  ValueLoss(c.values, batch.action.ret, terms, c.dlogp);
  c.critic.dout = c.dlogp.transpose();
  critic_net_.Backward(batch.s, c.critic);

  terms.total = terms.surrogate - entropy_weight_ * terms.entropy + terms.value;
  return terms;
}

void Ppo::OptionPolicy(const Mat& s, const std::vector<int>&, const std::vector<char>&, Mat& P) {
  P.setOnes(1, s.cols());
}

void Ppo::ActionPolicy(const Mat& s, const std::vector<int>&, Mat& mu, Mat& sigma) {
  MakeSigma();
  Cache& c = caches_(s.cols());
  Actor(s, c);
  mu = c.actor.out;
  sigma = sigma_.replicate(1, s.cols());
}

}  // namespace

std::unique_ptr<Algorithm> MakePpo(const AlgorithmInput& in) { return std::make_unique<Ppo>(in); }

}  // namespace o2v
