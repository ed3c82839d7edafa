#include "algo/algorithm.h"
#include "algo/ppo_core.h"
#include "algo/surrogate.h"
#include "dist/diag_gaussian.h"
#include "nn/mlp.h"

namespace o2v {
namespace {

/// PPO: proximal policy optimisation with a Gaussian actor and a separate critic.
///
///   mu(s) = tanh(W_mu Body(s) + b),  sigma = softplus(rho) free of the state
///   v(s)  = w_v Body'(s) + b_v
///   L = clip-surrogate(ln N(a; mu, sigma), old, A_hat) - w mean H + 1/2 mean (v - R)^2
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
    Net::Cache actor, critic;  // the actor's output is mu (A, B)
    Mat dsigma;                // (A, 1)
    Vec logp, dlogp, values;   // (B)
  };

  /// s (S, B) -> c.actor.out = mu; sigma is in sigma_.
  void Actor(const ConstMatRef& s, Cache& c) const;
  void MakeSigma();  // sigma_ = softplus(rho)

  const PpoHyper hyper_;
  const Switches switches_;
  const double entropy_weight_;  // w
  const int N_;
  Rng policy_rng_, shuffle_rng_;

  Net actor_, critic_net_;
  Param rho_;  // (A, 1)
  std::unique_ptr<Adam> adam_;
  std::vector<char> in_graph_;

  Batch rollout_;  // T N samples
  MatD mask_;      // (N, T)
  CriticStream critic_;
  CacheByWidth<Cache> caches_;
  Mat sigma_, a_;  // (A, 1), (A, N)
  Transition transition_;
  Minibatches minibatches_;
  LossMeans means_;
};

Ppo::Ppo(const AlgorithmInput& in)
    : hyper_(*in.hyper),
      switches_(in.switches),
      entropy_weight_(in.hyper->Real("entropy_weight")),
      N_(in.workers),
      policy_rng_(in.seed, "policy"),
      shuffle_rng_(in.seed, "shuffle"),
      rho_("actor.rho", in.A, 1),
      critic_(in.workers, hyper_.rollout),
      minibatches_(Index(in.workers) * hyper_.rollout) {
  Rng init(in.seed, "init");
  const Index h = in.hyper->Int("hidden", 1);
  const Activation g = ReadActivation(*in.hyper);
  actor_ = Net("actor.body", "actor.head", in.S, h, in.A, g, init);
  critic_net_ = Net("critic.body", "critic.v", in.S, h, 1, g, init);
  adam_ = std::make_unique<Adam>(Params(), hyper_.adam);
  in_graph_.assign(Params().size(), 1);

  rollout_.Resize(in.S, in.A, Index(N_) * hyper_.rollout);
  mask_ = MatD::Ones(N_, hyper_.rollout);
}

std::vector<Param*> Ppo::Params() {
  std::vector<Param*> params = actor_.Params();
  params.push_back(&rho_);
  Append(params, critic_net_.Params());
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
  actor_.Forward(s, c.actor);
  Tanh(c.actor.out);
}

void Ppo::Collect(VecEnv& env, std::vector<Episode>& episodes) {
  MakeSigma();
  Cache& c = caches_(N_);
  for (int t = 0; t < hyper_.rollout; ++t) {
    const Index column = Index(t) * N_;
    Actor(env.States(), c);
    SampleGaussian(c.actor.out, sigma_, policy_rng_, a_);
    GaussianLogProb(a_, c.actor.out, sigma_, c.logp);
    rollout_.s.middleCols(column, N_) = env.States();
    rollout_.a.middleCols(column, N_) = a_;
    rollout_.low.logp_old.segment(column, N_) = c.logp;

    env.Step(a_, transition_, episodes);
    critic_.r.col(t) = transition_.r;
    if (RecordEnds(transition_, t, mask_) && switches_.timelimit == Fidelity::kPaper) {
      critic_net_.Forward(transition_.s_last, c.critic);
      for (int i = 0; i < N_; ++i) {
        if (!transition_.TimeLimit(std::size_t(i))) continue;
        critic_.r(i, t) += hyper_.gamma * static_cast<double>(c.critic.out(0, i));
      }
    }
  }
  // The critic does not act, so its values are taken after the rollout, in blocks.
  ForEachBlock(rollout_.Size(), hyper_.minibatch, [&](Index start, Index n) {
    Cache& block = caches_(n);
    critic_net_.Forward(rollout_.s.middleCols(start, n), block.critic);
    Eigen::Map<VecD>(critic_.v.data() + start, n) =
        block.critic.out.row(0).transpose().cast<double>();
  });
  critic_net_.Forward(env.States(), c.critic);
  critic_.v.col(hyper_.rollout) = c.critic.out.row(0).transpose().cast<double>();
  critic_.Finish(mask_, hyper_, switches_.adv_std_eps, rollout_.low);
}

LossTerms Ppo::Loss(int, const Batch& batch, const FixedDraws*) {
  LossTerms terms;
  Cache& c = caches_(batch.Size());
  MakeSigma();
  Actor(batch.s, c);
  const Mat& mu = c.actor.out;
  GaussianLogProb(batch.a, mu, sigma_, c.logp);
  ClippedSurrogate(c.logp, batch.low.logp_old, batch.low.adv_hat, hyper_.ratio_clip, terms,
                   c.dlogp);
  terms.entropy = GaussianMeanEntropy(sigma_);

  GaussianLogProbGrad(batch.a, mu, sigma_, c.dlogp, c.actor.dout, c.dsigma);
  AddGaussianEntropyGrad(sigma_, Real(-entropy_weight_), c.dsigma);
  SoftplusBackward(sigma_, c.dsigma);
  rho_.grad += c.dsigma;
  ActivationBackward(Activation::kTanh, mu, c.actor.dout);
  actor_.Backward(batch.s, c.actor);

  critic_net_.Forward(batch.s, c.critic);
  c.values = c.critic.out.row(0).transpose();
  ValueLoss(c.values, batch.low.ret, terms, c.dlogp);
  c.critic.dout = c.dlogp.transpose();
  critic_net_.Backward(batch.s, c.critic);

  terms.total = terms.surrogate - entropy_weight_ * terms.entropy + terms.value;
  return terms;
}

double Ppo::Step(int) { return adam_->Step(in_graph_, IdleRule::kSkip); }

void Ppo::Update(std::vector<double>& stats) {
  means_.Clear();
  minibatches_.Run(rollout_, hyper_, shuffle_rng_, [&](const Batch& batch) {
    const LossTerms terms = Loss(0, batch, nullptr);
    means_.Add(terms, Step(0));
  });
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
  mu = c.actor.out;
  sigma = sigma_.replicate(1, s.cols());
}

void Ppo::OptionValues(const Mat& s, const std::vector<int>&, Mat& q) {
  Cache& c = caches_(s.cols());
  critic_net_.Forward(s, c.critic);
  q = c.critic.out;
}

}  // namespace

std::unique_ptr<Algorithm> MakePpo(const AlgorithmInput& in) { return std::make_unique<Ppo>(in); }

}  // namespace o2v
