#include "algo/method.h"
#include "algo/option_policy.h"
#include "dist/categorical.h"
#include "dist/diag_gaussian.h"
#include "rollout/rollout.h"

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
class OptionCritic final : public Method {
 public:
  explicit OptionCritic(const AlgorithmInput& in);

  void Collect(VecEnv& env, std::vector<Episode>& episodes) override;
  const std::vector<SumAndCount>& Update() override;
  void Serialize(StateVisitor& v) override;
  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override;
  LossTerms Loss(int stage, const Batch& batch, const FixedDraws* fixed) override;

 private:
  struct Cache {
    OptionNets::CallAndReturnCache options;
    OptionNets::BetaCache target_beta;  // of o, of the target network
    ActionCache action;
    ValueCache value;    // value.critic.out is q (K, B)
    Mat e, P;            // (K, B)
    std::vector<int> o;  // (B)
    Vec ret;             // (B) R
    VecD end;            // (N) values of the target network
  };

  /// The distribution P that options are drawn from, at s.
  const Mat& Options(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init);
  /// (1 - beta_o) q_o + beta_o max_k q_k of the target network at s -> c.end.
  void TargetValue(const ConstMatRef& s, std::span<const int> o, Cache& c) const;
  /// R (B), from the last step backwards.
  void Targets(const Batch& batch, Vec& ret);
  void TerminationLoss(const Batch& batch, LossTerms& terms, Cache& c);
  void CopyToTarget();

  const double gamma_;
  const int T_;
  const Real w_, eta_, epsilon_;
  const int target_every_;  // [environment steps a worker]
  OptionNets nets_, target_;
  std::vector<Param*> target_params_;

  Batch rollout_;  // T N samples
  MatD mask_;      // (N, T)
  CacheByWidth<Cache> caches_;
  Mat a_;  // (A, N)
  Transition transition_;
};

OptionCritic::OptionCritic(const AlgorithmInput& in)
    : Method(in, in.hyper->Int("options", 1), {"all"}, {{"termination", &LossTerms::termination}}),
      gamma_(in.hyper->Real("gamma")),
      T_(in.hyper->Int("rollout", 1)),
      w_(Real(in.hyper->Real("entropy_weight"))),
      eta_(Real(in.hyper->Real("termination_penalty"))),
      epsilon_(Real(in.hyper->Real("epsilon_greedy"))),
      target_every_(in.hyper->Int("target_every", 1)) {
  nets_ = MakeOptionNets(in, OptionNets::CriticHead::kQ, initialiser_);
  target_ = nets_;
  target_params_ = target_.Params();
  std::vector<Param*> used = nets_.critic.Params();  // no master policy
  for (Index k = 0; k < K_; ++k) Append(used, nets_.policy.Params(k));
  Append(used, nets_.beta.Params());
  RegisterNetworks(in, nets_.Params(), {used}, &nets_.policy, &nets_.critic);

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

void OptionCritic::Serialize(StateVisitor& v) {
  Method::Serialize(v);
  for (Param* p : target_params_) v.Matrix("target." + p->name, p->value);
}

const Mat& OptionCritic::Options(const ConstMatRef& s, std::span<const int> o_prev,
                                 std::span<const char> init) {
  Cache& c = caches_(s.cols());
  const Mat& q = c.value.critic.out;
  nets_.critic.Forward(s, c.value.critic);
  c.e.setConstant(K_, s.cols(), epsilon_ / Real(K_));
  for (Index b = 0; b < s.cols(); ++b) {
    Index best = 0;
    q.col(b).maxCoeff(&best);
    c.e(best, b) += 1 - epsilon_;
  }
  nets_.CallAndReturn(s, o_prev, init, c.e, switches_.beta_index, c.options);
  c.P = c.options.pi_hat;
  if (switches_.oc_sampling == Fidelity::kPaper) return c.P;
  for (Index b = 0; b < s.cols(); ++b) {  // the mixture is taken for logits; spec 4.3 (g)
    if (!init[std::size_t(b)]) c.P.col(b) = c.options.pi_hat.col(b).array().exp();
  }
  return c.P;
}

void OptionCritic::TargetValue(const ConstMatRef& s, std::span<const int> o, Cache& c) const {
  const Mat& q = c.value.critic.out;
  target_.critic.Forward(s, c.value.critic);
  target_.Beta(s, o, false, c.target_beta);
  c.end.resize(s.cols());
  for (Index b = 0; b < s.cols(); ++b) {
    const int k = o[std::size_t(b)];
    const double beta = c.target_beta.beta(k, b);
    c.end(b) = (1 - beta) * double(q(k, b)) + beta * double(q.col(b).maxCoeff());
  }
}

void OptionCritic::Collect(VecEnv& env, std::vector<Episode>& episodes) {
  Cache& c = caches_(N_);
  IntraOptionPolicies::Cache& policy = c.action.policy;
  c.o.resize(std::size_t(N_));
  for (int t = 0; t < T_; ++t) {
    const Index first = Index(t) * N_;
    const Mat& s = env.States();
    SampleCategorical(Options(s, o_prev_, env.EpisodeStarts()), policy_rng_, c.o);
    nets_.policy.ForwardOne(s, c.o, policy);
    SampleGaussian(policy.nets.out, policy.sigma, policy_rng_, a_);
    rollout_.s.middleCols(first, N_) = s;
    rollout_.a.middleCols(first, N_) = a_;
    RecordOptions(first, c.o, env.EpisodeStarts(), rollout_);

    env.Step(a_, transition_, episodes);
    rollout_.r.segment(first, N_) = transition_.r;
    if (RecordEnds(transition_, t, mask_) && switches_.timelimit == Fidelity::kPaper) {
      TargetValue(transition_.s_last, o_prev_, c);
      for (int i = 0; i < N_; ++i) {
        if (transition_.TimeLimit(std::size_t(i))) rollout_.r(first + i) += gamma_ * c.end(i);
      }
    }
    rollout_.mask.segment(first, N_) = mask_.col(t);
    if (env.TotalSteps() / N_ % target_every_ == 0) CopyToTarget();
  }
  rollout_.s_end = env.States();
}

void OptionCritic::Targets(const Batch& batch, Vec& ret) {
  const Index B = batch.Size(), N = batch.s_end.cols();  // the columns of a step are its N workers
  Cache& end = caches_(N);
  TargetValue(batch.s_end, std::span<const int>(batch.o).last(std::size_t(N)), end);
  ret.resize(B);
  for (Index start = B - N; start >= 0; start -= N) {
    for (Index i = 0; i < N; ++i) {
      const Index b = start + i;
      end.end(i) = batch.r(b) + gamma_ * batch.mask(b) * end.end(i);
      ret(b) = Real(end.end(i));
    }
  }
}

LossTerms OptionCritic::Loss(int, const Batch& batch, const FixedDraws*) {
  LossTerms terms;
  Cache& c = caches_(batch.Size());
  Targets(batch, c.ret);
  EntryValueLoss(nets_.critic, batch.s, batch.o, c.ret, terms, c.value);

  IntraOptionPolicies::Cache& policy = c.action.policy;
  Vec &logp = c.action.logp, &dlogp = c.action.dlogp;
  ActionLogProb(nets_.policy, batch, c.action);
  dlogp = Real(1) / Real(batch.Size()) * (c.value.v - c.ret);  // -A / n
  terms.surrogate = double(dlogp.dot(logp));
  terms.entropy = GaussianMeanEntropy(policy.sigma);
  GaussianLogProbGrad(batch.a, policy.nets.out, policy.sigma, dlogp, policy.nets.dout,
                      policy.dsigma);
  AddGaussianEntropyGrad(policy.sigma, -w_, policy.dsigma);
  nets_.policy.Backward(batch.s, batch.o, policy);

  TerminationLoss(batch, terms, c);
  terms.total = terms.surrogate - double(w_) * terms.entropy + terms.value + terms.termination;
  return terms;
}

/// db_{o'} = (1/n) (1 - init) X beta (1 - beta); spec 4.3 (e)
void OptionCritic::TerminationLoss(const Batch& batch, LossTerms& terms, Cache& c) {
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
    const Real X =
        q(o_prev, b) - (1 - epsilon_) * q.col(b).maxCoeff() - epsilon_ * q.col(b).mean() + eta_;
    terms.termination += double(scale * beta * X);
    betas.db(o_prev, b) = scale * X * beta * (1 - beta);
  }
  nets_.BackwardBeta(batch.s, batch.o_prev, betas);
}

const std::vector<SumAndCount>& OptionCritic::Update() {
  Learn(0, rollout_);
  return Report();
}

void OptionCritic::OptionPolicy(const Mat& s, const std::vector<int>& o_prev,
                                const std::vector<char>& init, Mat& P) {
  P = Options(s, o_prev, init);
  NormalizeColumns(P);
}

}  // namespace

std::unique_ptr<Algorithm> MakeOc(const AlgorithmInput& in) {
  return std::make_unique<OptionCritic>(in);
}

}  // namespace o2v
