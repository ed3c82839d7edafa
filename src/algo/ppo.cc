#include "algo/algorithm.h"
#include "algo/ppo_core.h"
#include "algo/surrogate.h"
#include "base/check.h"
#include "dist/diag_gaussian.h"
#include "nn/init.h"
#include "nn/mlp.h"
#include "rollout/minibatch.h"

namespace o2v {
namespace {

/// PPO: proximal policy optimisation with a Gaussian actor and a separate critic.
///
///   mu(s) = tanh(W_mu Body(s) + b),  sigma = softplus(rho) free of the state,  v(s) = w Body'(s) +
///   b L = clip-surrogate(ln N(a; mu, sigma), old, A_hat) - w mean H + 1/2 mean (v - R)^2
///
/// Source: spec 2.2, 4.1; Schulman et al. 2017.
class Ppo final : public Algorithm {
 public:
  explicit Ppo(const AlgorithmInput& in);

  void Collect(VecEnv& env, std::vector<Episode>& episodes) override;
  void Update(std::vector<double>& stats) override;
  std::vector<std::string> StatNames() const override;
  std::vector<Param*> Params() override;
  void Visit(StateVisitor& v) override;

  int NumOptions() const override { return 1; }
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
    Body::Cache actor, critic;
    Mat mu, dmu, dhidden;     // (A, B), (A, B), (h, B)
    Mat v, dv;                // (1, B)
    Mat dsigma;               // (A, 1)
    Vec logp, dlogp, values;  // (B)
  };

  void Actor(const ConstMatRef& s, Cache& c) const;   // -> c.mu; sigma is in sigma_
  void Critic(const ConstMatRef& s, Cache& c) const;  // -> c.v
  void MakeSigma();                                   // sigma_ = softplus(rho)

  const PpoHyper hyper_;
  const Switches switches_;
  const double entropy_weight_;  // w
  const int N_;
  Rng policy_rng_, shuffle_rng_;

  Body actor_body_, critic_body_;
  Linear actor_head_, critic_head_;
  Param rho_;  // (A, 1)
  std::unique_ptr<Adam> adam_;
  std::vector<char> in_graph_;

  Batch rollout_;  // T N samples
  MatD mask_;      // (N, T)
  CriticStream critic_;
  CacheByWidth<Cache> caches_;
  Mat sigma_, a_;  // (A, 1), (A, N)
  Transition transition_;
  std::vector<int> order_;
  Batch minibatch_, rest_;
  LossMeans means_;
};

Activation ReadActivation(const Settings& s) {
  return s.Int("activation") == 0 ? Activation::kTanh : Activation::kRelu;
}

Ppo::Ppo(const AlgorithmInput& in)
    : hyper_(*in.hyper),
      switches_(in.switches),
      entropy_weight_(in.hyper->Real("entropy_weight")),
      N_(in.workers),
      policy_rng_(in.seed, "policy"),
      shuffle_rng_(in.seed, "shuffle"),
      actor_head_("actor.head", in.hyper->Int("hidden", 1), in.A),
      critic_head_("critic.v", in.hyper->Int("hidden", 1), 1),
      rho_("actor.rho", in.A, 1),
      critic_(in.workers, hyper_.rollout) {
  Rng init(in.seed, "init");
  const Index h = in.hyper->Int("hidden", 1);
  const Activation g = ReadActivation(*in.hyper);
  actor_body_ = Body("actor.body", in.S, h, g, init);
  Orthogonal(actor_head_.W.value, 1e-3, init);  // spec 2.1
  critic_body_ = Body("critic.body", in.S, h, g, init);
  Orthogonal(critic_head_.W.value, 1e-3, init);
  adam_ = std::make_unique<Adam>(Params(), hyper_.adam);
  in_graph_.assign(Params().size(), 1);

  const Index n = Index(N_) * hyper_.rollout;
  rollout_.Resize(in.S, in.A, n);
  mask_ = MatD::Ones(N_, hyper_.rollout);
  order_.resize(std::size_t(n));
}

std::vector<Param*> Ppo::Params() {
  std::vector<Param*> params = actor_body_.Params();
  Append(params, actor_head_.Params());
  params.push_back(&rho_);
  Append(params, critic_body_.Params());
  Append(params, critic_head_.Params());
  return params;
}

void Ppo::Visit(StateVisitor& v) {
  for (Param* p : Params()) v.Matrix(p->name, p->value);
  adam_->Visit(v);
  policy_rng_.Visit(v, "rng.policy");
  shuffle_rng_.Visit(v, "rng.shuffle");
}

void Ppo::MakeSigma() {
  sigma_ = rho_.value;
  Softplus(sigma_);
}

void Ppo::Actor(const ConstMatRef& s, Cache& c) const {
  actor_body_.Forward(s, c.actor);
  c.mu.resize(actor_head_.W.value.rows(), s.cols());
  actor_head_.Multiply(c.actor.h1, c.mu);
  BiasActivate(Activation::kTanh, actor_head_.b.value, c.mu);
}

void Ppo::Critic(const ConstMatRef& s, Cache& c) const {
  critic_body_.Forward(s, c.critic);
  c.v.resize(1, s.cols());
  critic_head_.Forward(c.critic.h1, c.v);
}

void Ppo::Collect(VecEnv& env, std::vector<Episode>& episodes) {
  MakeSigma();
  Cache& c = caches_(N_);
  for (int t = 0; t < hyper_.rollout; ++t) {
    const Index column = Index(t) * N_;
    Actor(env.States(), c);
    SampleGaussian(c.mu, sigma_, policy_rng_, a_);
    GaussianLogProb(a_, c.mu, sigma_, c.logp);
    rollout_.s.middleCols(column, N_) = env.States();
    rollout_.a.middleCols(column, N_) = a_;
    rollout_.low.logp_old.segment(column, N_) = c.logp;

    env.Step(a_, transition_, episodes);
    critic_.r.col(t) = transition_.r;
    bool bootstrap = false;
    for (int i = 0; i < N_; ++i) {
      mask_(i, t) = transition_.Done(std::size_t(i)) ? 0 : 1;
      bootstrap |= transition_.TimeLimit(std::size_t(i));
    }
    if (bootstrap && switches_.timelimit == Fidelity::kPaper) {
      Critic(transition_.s_last, c);
      for (int i = 0; i < N_; ++i) {
        if (transition_.TimeLimit(std::size_t(i))) {
          critic_.r(i, t) += hyper_.gamma * static_cast<double>(c.v(0, i));
        }
      }
    }
  }
  // The critic does not act, so its values are taken after the rollout, in blocks.
  ForEachBlock(rollout_.Size(), hyper_.minibatch, [&](Index start, Index n) {
    Cache& block = caches_(n);
    Critic(rollout_.s.middleCols(start, n), block);
    Eigen::Map<VecD>(critic_.v.data() + start, n) = block.v.row(0).transpose().cast<double>();
  });
  Critic(env.States(), c);
  critic_.v.col(hyper_.rollout) = c.v.row(0).transpose().cast<double>();
  critic_.Finish(mask_, hyper_, switches_.adv_std_eps, rollout_.low);
}

LossTerms Ppo::Loss(int, const Batch& batch, const FixedDraws*) {
  LossTerms terms;
  Cache& c = caches_(batch.Size());
  MakeSigma();
  Actor(batch.s, c);
  GaussianLogProb(batch.a, c.mu, sigma_, c.logp);
  ClippedSurrogate(c.logp, batch.low.logp_old, batch.low.adv_hat, hyper_.ratio_clip, terms,
                   c.dlogp);
  terms.entropy = GaussianMeanEntropy(sigma_);

  GaussianLogProbGrad(batch.a, c.mu, sigma_, c.dlogp, c.dmu, c.dsigma);
  AddGaussianEntropyGrad(sigma_, Real(-entropy_weight_), c.dsigma);
  SoftplusBackward(sigma_, c.dsigma);
  rho_.grad += c.dsigma;
  ActivationBackward(Activation::kTanh, c.mu, c.dmu);
  actor_head_.AddGrad(c.actor.h1, c.dmu);
  c.dhidden.resize(c.actor.h1.rows(), batch.Size());
  actor_head_.BackwardInput(c.dmu, c.dhidden);
  actor_body_.Backward(batch.s, c.actor, c.dhidden);

  Critic(batch.s, c);
  c.values = c.v.row(0).transpose();
  c.dv.resize(1, batch.Size());
  ValueLoss(c.values, batch.low.ret, terms, c.dlogp);
  c.dv.row(0) = c.dlogp.transpose();
  critic_head_.AddGrad(c.critic.h1, c.dv);
  critic_head_.BackwardInput(c.dv, c.dhidden);
  critic_body_.Backward(batch.s, c.critic, c.dhidden);

  terms.total = terms.surrogate - entropy_weight_ * terms.entropy + terms.value;
  return terms;
}

double Ppo::Step(int) { return adam_->Step(in_graph_, IdleRule::kSkip); }

void Ppo::Update(std::vector<double>& stats) {
  means_.Clear();
  for (int epoch = 0; epoch < hyper_.epochs; ++epoch) {
    ForEachMinibatch(order_, hyper_.minibatch, shuffle_rng_, [&](std::span<const int> rows) {
      Batch& batch = int(rows.size()) == hyper_.minibatch ? minibatch_ : rest_;
      Gather(rollout_, rows, batch);
      const LossTerms terms = Loss(0, batch, nullptr);
      means_.Add(terms, Step(0));
    });
  }
  stats.clear();
  means_.Report(stats);
}

std::vector<std::string> Ppo::StatNames() const {
  std::vector<std::string> names;
  LossMeans::Names("all", names);
  return names;
}

void Ppo::OptionPolicy(const Mat& s, const std::vector<int>&, const std::vector<char>&, Mat& P) {
  P.setOnes(1, s.cols());
}

void Ppo::ActionPolicy(const Mat& s, const std::vector<int>&, Mat& mu, Mat& sigma) {
  MakeSigma();
  Cache& c = caches_(s.cols());
  Actor(s, c);
  mu = c.mu;
  sigma = sigma_.replicate(1, s.cols());
}

void Ppo::OptionValues(const Mat& s, const std::vector<int>&, Mat& q) {
  Cache& c = caches_(s.cols());
  Critic(s, c);
  q = c.v;
}

}  // namespace

std::unique_ptr<Algorithm> MakePpo(const AlgorithmInput& in) { return std::make_unique<Ppo>(in); }

}  // namespace o2v
