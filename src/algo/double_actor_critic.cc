#include "algo/double_actor_critic.h"

#include "dist/categorical.h"
#include "dist/diag_gaussian.h"

namespace o2v {

DoubleActorCritic::DoubleActorCritic(const AlgorithmInput& in)
    : hyper_(*in.hyper),
      switches_(in.switches),
      w_(in.hyper->Real("entropy_weight")),
      K_(in.hyper->Int("options", 1)),
      N_(in.workers),
      option_log_(in.switches.density_log_eps),
      policy_rng_(in.seed, "policy"),
      bootstrap_rng_(in.seed, "bootstrap"),
      shuffle_rng_(in.seed, "shuffle"),
      order_rng_(in.seed, "order"),
      high_(in.workers, hyper_.rollout),
      low_(in.workers, hyper_.rollout),
      minibatches_(Index(in.workers) * hyper_.rollout),
      usage_(K_) {
  const Index n = Index(N_) * hyper_.rollout;
  rollout_.Resize(in.S, in.A, n);
  rollout_.P_old = Mat::Zero(K_, n);
  mask_ = MatD::Ones(N_, hyper_.rollout);
  o_prev_.assign(std::size_t(N_), 0);
  not_initial_.assign(std::size_t(N_), 0);
}

void DoubleActorCritic::Assemble(OptionPolicies& policy, Net& critic,
                                 bool (*in_high)(const std::string& name),
                                 bool (*in_low)(const std::string& name)) {
  policy_ = &policy;
  critic_ = &critic;
  const std::vector<Param*> params = Params();
  for (const Param* p : params) {
    in_graph_[kHigh].push_back(in_high(p->name));
    in_graph_[kLow].push_back(in_low(p->name));
  }
  adam_ = std::make_unique<Adam>(params, hyper_.adam);
}

void DoubleActorCritic::Visit(StateVisitor& v) {
  for (Param* p : Params()) v.Matrix(p->name, p->value);
  adam_->Visit(v);
  policy_rng_.Visit(v, "rng.policy");
  bootstrap_rng_.Visit(v, "rng.bootstrap");
  shuffle_rng_.Visit(v, "rng.shuffle");
  order_rng_.Visit(v, "rng.order");
  v.Ints("o_prev", o_prev_);
}

// ---- Rollout ------------------------------------------------------------------------------------

void DoubleActorCritic::Evaluate(const Mat& s, std::span<const char> init, Cache& c) {
  OptionForward(s, o_prev_, init, Asked::kActing, c.p);
  SampleCategorical(c.p, bootstrap_rng_, c.o);
  critic_->Forward(s, c.critic);
}

void DoubleActorCritic::Collect(VecEnv& env, std::vector<Episode>& episodes) {
  policy_->MakeSigma();
  usage_.Clear();
  Cache& c = caches_(N_);
  const Mat &p = c.p, &q = c.critic.out, &mu = c.policy.nets.out, &sigma = c.policy.sigma;
  c.o.resize(std::size_t(N_));
  for (int t = 0; t < hyper_.rollout; ++t) {
    const Index column = Index(t) * N_;
    const Mat& s = env.States();
    OptionForward(s, o_prev_, env.Init(), Asked::kActing, c.p);
    SampleCategorical(p, policy_rng_, c.o);
    policy_->ForwardOne(s, c.o, c.policy);
    SampleGaussian(mu, sigma, policy_rng_, a_);

    rollout_.s.middleCols(column, N_) = s;
    rollout_.a.middleCols(column, N_) = a_;
    rollout_.P_old.middleCols(column, N_) = p;
    option_log_.LogProb(p, c.o, c.logp);
    rollout_.high.logp_old.segment(column, N_) = c.logp;
    GaussianLogProb(a_, mu, sigma, c.logp);
    LogDensity(switches_.density_log_eps, c.logp, c.log_slope);
    rollout_.low.logp_old.segment(column, N_) = c.logp;
    RecordOptions(column, c.o, env.Init(), o_prev_, rollout_, usage_);

    env.Step(a_, transition_, episodes);
    high_.r.col(t) = low_.r.col(t) = transition_.r;
    if (RecordEnds(transition_, t, mask_) && switches_.timelimit == Fidelity::kPaper) {
      // v^high and v^low at (s_last, o_t), o ~ p(. | s_last, o_t); spec 1.3
      Evaluate(transition_.s_last, not_initial_, c);
      for (int i = 0; i < N_; ++i) {
        if (!transition_.TimeLimit(std::size_t(i))) continue;
        high_.r(i, t) += hyper_.gamma * double(p.col(i).dot(q.col(i)));
        low_.r(i, t) += hyper_.gamma * double(q(c.o[std::size_t(i)], i));
      }
    }
  }
  // The critic does not act, so its values are taken after the rollout, in blocks.
  ForEachBlock(rollout_.Size(), hyper_.minibatch, [&](Index start, Index n) {
    Net::Cache& block = caches_(n).critic;
    critic_->Forward(rollout_.s.middleCols(start, n), block);
    for (Index b = 0; b < n; ++b) {
      const Index row = start + b;
      high_.v.data()[row] = double(rollout_.P_old.col(row).dot(block.out.col(b)));
      low_.v.data()[row] = double(block.out(rollout_.o[std::size_t(row)], b));
    }
  });
  // v_T: one more pass; the option that it draws is thrown away (spec 1.3).
  Evaluate(env.States(), env.Init(), c);
  for (int i = 0; i < N_; ++i) {
    high_.v(i, hyper_.rollout) = double(p.col(i).dot(q.col(i)));
    low_.v(i, hyper_.rollout) = double(q(c.o[std::size_t(i)], i));
  }
  high_.Finish(mask_, hyper_, switches_.adv_std_eps, rollout_.high);
  low_.Finish(mask_, hyper_, switches_.adv_std_eps, rollout_.low);
}

// ---- Losses -------------------------------------------------------------------------------------

LossTerms DoubleActorCritic::Loss(int stage, const Batch& batch, const FixedDraws*) {
  return stage == kHigh ? HighLoss(batch) : LowLoss(batch);
}

LossTerms DoubleActorCritic::HighLoss(const Batch& batch) {
  LossTerms terms;
  const Index B = batch.Size();
  Cache& c = caches_(B);
  OptionForward(batch.s, batch.o_prev, batch.init, Asked::kUpdate, c.p);
  critic_->Forward(batch.s, c.critic);
  option_log_.LogProb(c.p, batch.o, c.logp);
  ClippedSurrogate(c.logp, batch.high.logp_old, batch.high.adv_hat, hyper_.ratio_clip, terms,
                   c.dlogp);
  terms.entropy = option_log_.MeanEntropy(c.p);
  c.v = batch.P_old.cwiseProduct(c.critic.out).colwise().sum().transpose();
  ValueLoss(c.v, batch.high.ret, terms, c.dv);
  terms.total = terms.surrogate - w_ * terms.entropy + terms.value;

  option_log_.Backward(c.p, batch.o, c.dlogp, -w_, c.dp);
  OptionBackward(batch.s, batch.o_prev, batch.init, c.dp);
  c.critic.dout = batch.P_old * c.dv.asDiagonal();
  critic_->Backward(batch.s, c.critic);
  return terms;
}

LossTerms DoubleActorCritic::LowLoss(const Batch& batch) {
  LossTerms terms;
  const Index B = batch.Size();
  Cache& c = caches_(B);
  const Mat &mu = c.policy.nets.out, &sigma = c.policy.sigma, &q = c.critic.out;
  policy_->MakeSigma();
  policy_->ForwardOne(batch.s, batch.o, c.policy);
  GaussianLogProb(batch.a, mu, sigma, c.logp);
  LogDensity(switches_.density_log_eps, c.logp, c.log_slope);
  ClippedSurrogate(c.logp, batch.low.logp_old, batch.low.adv_hat, hyper_.ratio_clip, terms,
                   c.dlogp);
  terms.entropy = GaussianMeanEntropy(sigma);
  c.dlogp.array() *= c.log_slope.array();
  GaussianLogProbGrad(batch.a, mu, sigma, c.dlogp, c.policy.nets.dout, c.policy.dsigma);
  policy_->Backward(batch.s, batch.o, c.policy);

  critic_->Forward(batch.s, c.critic);
  c.v.resize(B);
  for (Index b = 0; b < B; ++b) c.v(b) = q(batch.o[std::size_t(b)], b);
  ValueLoss(c.v, batch.low.ret, terms, c.dv);
  c.critic.dout.setZero(K_, B);
  for (Index b = 0; b < B; ++b) c.critic.dout(batch.o[std::size_t(b)], b) = c.dv(b);
  critic_->Backward(batch.s, c.critic);
  terms.total = terms.surrogate + terms.value;
  return terms;
}

// ---- Update -------------------------------------------------------------------------------------

double DoubleActorCritic::Step(int stage) {
  return adam_->Step(in_graph_[stage], switches_.adam_idle == Fidelity::kPaper
                                           ? IdleRule::kSkip
                                           : IdleRule::kZeroGradient);
}

void DoubleActorCritic::RunStage(int stage) {
  means_[stage].Clear();
  minibatches_.Run(rollout_, hyper_, shuffle_rng_, [&](const Batch& batch) {
    const LossTerms terms = Loss(stage, batch, nullptr);
    means_[stage].Add(terms, Step(stage));
  });
}

void DoubleActorCritic::Update(std::vector<double>& stats) {
  const int first = order_rng_.Uniform() < 0.5 ? kHigh : kLow;  // fair coin; spec 4.6 (f)
  RunStage(first);
  RunStage(1 - first);
  stats.clear();
  for (const LossMeans& means : means_) means.Report(stats);
  usage_.Report(stats);
}

std::vector<std::string> DoubleActorCritic::StatNames() const {
  std::vector<std::string> names;
  for (const std::string& stage : Stages()) LossMeans::Names(stage, names);
  usage_.Names(names);
  return names;
}

// ---- Queries ------------------------------------------------------------------------------------

void DoubleActorCritic::OptionPolicy(const Mat& s, const std::vector<int>& o_prev,
                                     const std::vector<char>& init, Mat& P) {
  OptionForward(s, o_prev, init, Asked::kActing, P);
  for (Index b = 0; b < P.cols(); ++b) P.col(b) /= P.col(b).sum();
}

void DoubleActorCritic::ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) {
  Cache& c = caches_(s.cols());
  policy_->MakeSigma();
  policy_->ForwardOne(s, o, c.policy);
  mu = c.policy.nets.out;
  sigma = c.policy.sigma;
}

void DoubleActorCritic::OptionValues(const Mat& s, const std::vector<int>&, Mat& q) {
  Cache& c = caches_(s.cols());
  critic_->Forward(s, c.critic);
  q = c.critic.out;
}

}  // namespace o2v
