#include "algo/algorithm.h"
#include "algo/option_nets.h"
#include "algo/option_policy.h"
#include "algo/ppo_core.h"
#include "algo/surrogate.h"
#include "dist/categorical.h"
#include "dist/diag_gaussian.h"

namespace o2v {
namespace {

/// OC: the option-critic, synchronous and n-step. Options by call-and-return with an epsilon-greedy
/// choice e over q in place of a master policy.
///
///   R_t = r_t + gamma m_t R_{t+1}
///   R_T = (1 - beta_o) q_o + beta_o max_k q_k                         of the target network
///   A = R - q_o                                                       constant
///   X = q_{o'} - [(1 - eps) max_k q_k + eps mean_k q_k] + eta         constant
///   L = -mean A ln pi_o(a | s) - w mean H(pi_o) + 1/2 mean (q_o - R)^2
///       + mean beta_{o'} X (1 - init)
///
/// One step of the optimiser a rollout of T steps of N workers. The master network and the head u
/// are never used. Source: spec 4.3; Bacon et al. 2017.
class OptionCritic final : public Algorithm {
 public:
  explicit OptionCritic(const AlgorithmInput& in);

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
    Net::Cache critic;                        // out is q (K, B)
    OptionNets::BetaCache beta, target_beta;  // of the online network; of o, of the target network
    OptionPolicies::Cache policy;
    Mat e, M, pi_hat, P;     // (K, B)
    std::vector<int> o;      // (B)
    Vec logp, dlogp, v, dv;  // (B)
    Vec ret;                 // (B) R
    VecD end;                // (N) values of the target network
  };

  /// The distribution P that options are drawn from, at s.
  void Options(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init,
               Cache& c) const;
  /// (1 - beta_o) q_o + beta_o max_k q_k of the target network at s -> c.end.
  void TargetValue(const ConstMatRef& s, std::span<const int> o, Cache& c) const;
  void CopyToTarget();

  const double gamma_;
  const int T_;
  const Real w_, eta_, epsilon_;
  const int target_every_;  // [environment steps a worker]
  const Switches switches_;
  const Index K_;
  const int N_;
  Rng policy_rng_;
  OptionNets nets_, target_;
  std::vector<Param*> params_, target_params_;
  std::unique_ptr<Adam> adam_;
  std::vector<char> in_graph_;

  Batch rollout_;            // T N samples
  MatD mask_;                // (N, T)
  std::vector<int> o_prev_;  // (N)
  CacheByWidth<Cache> caches_;
  Mat a_;  // (A, N)
  Transition transition_;
  OptionUsage usage_;
  LossMeans means_;
};

OptionCritic::OptionCritic(const AlgorithmInput& in)
    : gamma_(in.hyper->Real("gamma")),
      T_(in.hyper->Int("rollout", 1)),
      w_(Real(in.hyper->Real("entropy_weight"))),
      eta_(Real(in.hyper->Real("termination_penalty"))),
      epsilon_(Real(in.hyper->Real("epsilon_greedy"))),
      target_every_(in.hyper->Int("target_every", 1)),
      switches_(in.switches),
      K_(in.hyper->Int("options", 1)),
      N_(in.workers),
      policy_rng_(in.seed, "policy"),
      usage_(K_) {
  Rng init(in.seed, "init");
  nets_ = OptionNets(K_, in.S, in.A, in.hyper->Int("hidden", 1), ReadActivation(*in.hyper),
                     OptionNets::CriticHead::kQ, init);
  target_ = nets_;
  params_ = nets_.Params();
  target_params_ = target_.Params();
  for (const Param* p : params_) {
    in_graph_.push_back(!p->name.starts_with("critic.u.") && !p->name.starts_with("master."));
  }
  adam_ = std::make_unique<Adam>(params_, ReadAdam(*in.hyper));

  const Index n = Index(N_) * T_;
  rollout_.Resize(in.S, in.A, n);
  rollout_.r = rollout_.mask = VecD::Zero(n);
  rollout_.s_end = Mat::Zero(in.S, N_);
  mask_ = MatD::Ones(N_, T_);
  o_prev_.assign(std::size_t(N_), std::min<int>(1, int(K_) - 1));  // spec 1.3
}

void OptionCritic::CopyToTarget() {
  for (std::size_t i = 0; i < params_.size(); ++i) target_params_[i]->value = params_[i]->value;
}

void OptionCritic::Visit(StateVisitor& v) {
  for (Param* p : params_) v.Matrix(p->name, p->value);
  for (Param* p : target_params_) v.Matrix("target." + p->name, p->value);
  adam_->Visit(v);
  policy_rng_.Visit(v, "rng.policy");
  v.Ints("o_prev", o_prev_);
}

void OptionCritic::Options(const ConstMatRef& s, std::span<const int> o_prev,
                           std::span<const char> init, Cache& c) const {
  nets_.critic.Forward(s, c.critic);
  c.e.setConstant(K_, s.cols(), epsilon_ / Real(K_));
  for (Index b = 0; b < s.cols(); ++b) {
    Index best = 0;
    c.critic.out.col(b).maxCoeff(&best);
    c.e(best, b) += 1 - epsilon_;
  }
  nets_.Beta(s, o_prev, switches_.beta_index == Fidelity::kReleased, c.beta);
  c.M.resize(K_, s.cols());
  OneHot(o_prev, c.M);
  CallAndReturn(c.e, c.beta.beta, c.M, o_prev, init, switches_.beta_index, c.pi_hat);
  c.P = c.pi_hat;
  if (switches_.oc_sampling == Fidelity::kPaper) return;
  for (Index b = 0; b < s.cols(); ++b) {  // the mixture is taken for logits; spec 4.3 (g)
    if (!init[std::size_t(b)]) c.P.col(b) = c.pi_hat.col(b).array().exp();
  }
}

void OptionCritic::TargetValue(const ConstMatRef& s, std::span<const int> o, Cache& c) const {
  target_.critic.Forward(s, c.critic);
  target_.Beta(s, o, false, c.target_beta);
  c.end.resize(s.cols());
  for (Index b = 0; b < s.cols(); ++b) {
    const int k = o[std::size_t(b)];
    const double beta = c.target_beta.beta(k, b);
    c.end(b) =
        (1 - beta) * double(c.critic.out(k, b)) + beta * double(c.critic.out.col(b).maxCoeff());
  }
}

void OptionCritic::Collect(VecEnv& env, std::vector<Episode>& episodes) {
  nets_.policy.MakeSigma();
  usage_.Clear();
  Cache& c = caches_(N_);
  c.o.resize(std::size_t(N_));
  for (int t = 0; t < T_; ++t) {
    const Index column = Index(t) * N_;
    const Mat& s = env.States();
    Options(s, o_prev_, env.Init(), c);
    SampleCategorical(c.P, policy_rng_, c.o);
    nets_.policy.ForwardOne(s, c.o, c.policy);
    SampleGaussian(c.policy.nets.out, c.policy.sigma, policy_rng_, a_);
    rollout_.s.middleCols(column, N_) = s;
    rollout_.a.middleCols(column, N_) = a_;
    RecordOptions(column, c.o, env.Init(), o_prev_, rollout_, usage_);

    env.Step(a_, transition_, episodes);
    rollout_.r.segment(column, N_) = transition_.r;
    if (RecordEnds(transition_, t, mask_) && switches_.timelimit == Fidelity::kPaper) {
      TargetValue(transition_.s_last, o_prev_, c);
      for (int i = 0; i < N_; ++i) {
        if (transition_.TimeLimit(std::size_t(i))) rollout_.r(column + i) += gamma_ * c.end(i);
      }
    }
    rollout_.mask.segment(column, N_) = mask_.col(t);
    if (env.TotalSteps() / N_ % target_every_ == 0) CopyToTarget();
  }
  rollout_.s_end = env.States();
}

LossTerms OptionCritic::Loss(int, const Batch& batch, const FixedDraws*) {
  LossTerms terms;
  const Index B = batch.Size(), N = batch.s_end.cols();
  const Real scale = Real(1) / Real(B);
  Cache& c = caches_(B);
  const Mat &mu = c.policy.nets.out, &sigma = c.policy.sigma, &q = c.critic.out;

  // Targets, from the last step backwards; the columns of a step are its N workers.
  Cache& end = caches_(N);
  TargetValue(batch.s_end, std::span<const int>(batch.o).last(std::size_t(N)), end);
  c.ret.resize(B);
  for (Index start = B - N; start >= 0; start -= N) {
    for (Index i = 0; i < N; ++i) {
      const Index b = start + i;
      end.end(i) = batch.r(b) + gamma_ * batch.mask(b) * end.end(i);
      c.ret(b) = Real(end.end(i));
    }
  }

  nets_.critic.Forward(batch.s, c.critic);
  c.v.resize(B);
  for (Index b = 0; b < B; ++b) c.v(b) = q(batch.o[std::size_t(b)], b);
  ValueLoss(c.v, c.ret, terms, c.dv);

  nets_.policy.MakeSigma();
  nets_.policy.ForwardOne(batch.s, batch.o, c.policy);
  GaussianLogProb(batch.a, mu, sigma, c.logp);
  c.dlogp = scale * (c.v - c.ret);  // -A / n
  terms.surrogate = double(c.dlogp.dot(c.logp));
  terms.entropy = GaussianMeanEntropy(sigma);
  GaussianLogProbGrad(batch.a, mu, sigma, c.dlogp, c.policy.nets.dout, c.policy.dsigma);
  AddGaussianEntropyGrad(sigma, -w_, c.policy.dsigma);
  nets_.policy.Backward(batch.s, batch.o, c.policy);

  nets_.Beta(batch.s, batch.o_prev, false, c.beta);
  c.beta.db.setZero(K_, B);
  for (Index b = 0; b < B; ++b) {
    const std::size_t i = std::size_t(b);
    if (batch.init[i]) continue;
    const int o_prev = batch.o_prev[i];
    const Real beta = c.beta.beta(o_prev, b);
    const Real X =
        q(o_prev, b) - (1 - epsilon_) * q.col(b).maxCoeff() - epsilon_ * q.col(b).mean() + eta_;
    terms.termination += double(scale * beta * X);
    c.beta.db(o_prev, b) = scale * X * beta * (1 - beta);
  }
  nets_.BackwardBeta(batch.s, batch.o_prev, c.beta);

  c.critic.dout.setZero(K_, B);
  for (Index b = 0; b < B; ++b) c.critic.dout(batch.o[std::size_t(b)], b) = c.dv(b);
  nets_.critic.Backward(batch.s, c.critic);
  terms.total = terms.surrogate - double(w_) * terms.entropy + terms.value + terms.termination;
  return terms;
}

double OptionCritic::Step(int) { return adam_->Step(in_graph_, IdleRule::kSkip); }

void OptionCritic::Update(std::vector<double>& stats) {
  means_.Clear();
  const LossTerms terms = Loss(0, rollout_, nullptr);
  means_.Add(terms, Step(0));
  stats.clear();
  means_.Report(stats);
  usage_.Report(stats);
}

std::vector<std::string> OptionCritic::StatNames() const {
  std::vector<std::string> names;
  LossMeans::Names("all", names);
  usage_.Names(names);
  return names;
}

void OptionCritic::OptionPolicy(const Mat& s, const std::vector<int>& o_prev,
                                const std::vector<char>& init, Mat& P) {
  Cache& c = caches_(s.cols());
  Options(s, o_prev, init, c);
  P = c.P;
  for (Index b = 0; b < P.cols(); ++b) P.col(b) /= P.col(b).sum();
}

void OptionCritic::ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) {
  Cache& c = caches_(s.cols());
  nets_.policy.MakeSigma();
  nets_.policy.ForwardOne(s, o, c.policy);
  mu = c.policy.nets.out;
  sigma = c.policy.sigma;
}

void OptionCritic::OptionValues(const Mat& s, const std::vector<int>&, Mat& q) {
  Cache& c = caches_(s.cols());
  nets_.critic.Forward(s, c.critic);
  q = c.critic.out;
}

}  // namespace

std::unique_ptr<Algorithm> MakeOc(const AlgorithmInput& in) {
  return std::make_unique<OptionCritic>(in);
}

}  // namespace o2v
