#include "algo/double_actor_critic.h"

#include "dist/categorical.h"
#include "dist/diag_gaussian.h"

namespace o2v {

DoubleActorCritic::DoubleActorCritic(const AlgorithmInput& in)
    : Method(in, in.hyper->Int("options", 1), {"high", "low"}),
      w_(in.hyper->Real("entropy_weight")),
      clip_(in.hyper->Real("ratio_clip")),
      option_log_(in.switches.density_log_eps),
      rollout_(in, /*critics=*/2) {
  rollout_.batch.P_old = Mat::Zero(K_, rollout_.batch.Size());
  o_prev_.assign(std::size_t(N_), 0);
}

void DoubleActorCritic::AssembleStages(const AlgorithmInput& in, std::vector<Param*> params,
                                       const Reaches& in_option_policy, OptionPolicies* policy,
                                       Net* critic) {
  const auto in_critic = [](const std::string& name) {
    return name.starts_with("critic.body.") || name.starts_with("critic.q.");
  };
  const Reaches high = [&](const std::string& name) {
    return in_option_policy(name) || in_critic(name);
  };
  const Reaches low = [&](const std::string& name) {
    return name.find(".mu.") != std::string::npos || name.ends_with(".rho") || in_critic(name);
  };
  Assemble(in, std::move(params), {high, low}, policy, critic);
}

void DoubleActorCritic::Collect(VecEnv& env, std::vector<Episode>& episodes) {
  policy_->MakeSigma();
  Batch& batch = rollout_.batch;
  Cache& c = caches_(N_);
  c.o.resize(std::size_t(N_));
  const auto act = [&](Index row) {
    const Mat& s = env.States();
    OptionForward(s, o_prev_, env.Init(), When::kActing, c.p);
    SampleCategorical(c.p, policy_rng_, c.o);
    SampleAction(*policy_, s, c.o, policy_rng_, rollout_.a, c.action);
    batch.P_old.middleCols(row, N_) = c.p;
    option_log_.LogProb(c.p, c.o, c.logp);
    batch.high.logp_old.segment(row, N_) = c.logp;
    LogDensity(switches_.density_log_eps, c.action.logp, c.action.slope);
    batch.low.logp_old.segment(row, N_) = c.action.logp;
    RecordOptions(row, c.o, env.Init(), batch);
  };
  const auto value = [&](const ConstMatRef& s, const ConstMatRef& p, std::span<const int> o,
                         Index row) {
    Net::Cache& critic = caches_(s.cols()).value.critic;
    critic_->Forward(s, critic);
    rollout_.SetOptionValues(p, critic.out, o, row);
  };
  rollout_.Collect(
      env, episodes, act,
      [&](Index row, Index n) {
        value(batch.s.middleCols(row, n), batch.P_old.middleCols(row, n), Rows(batch.o, row, n),
              row);
      },
      [&](const Mat& s, std::span<const char> init) {
        // The option o ~ p(. | s, o_{t-1}) that is drawn here is thrown away; spec 1.3.
        OptionForward(s, o_prev_, init, When::kActing, c.p);
        SampleCategorical(c.p, bootstrap_rng_, c.o);
        value(s, c.p, c.o, batch.Size());
      });
}

LossTerms DoubleActorCritic::Loss(int stage, const Batch& batch, const FixedDraws*) {
  return stage == kHigh ? HighLoss(batch) : LowLoss(batch);
}

LossTerms DoubleActorCritic::HighLoss(const Batch& batch) {
  LossTerms terms;
  Cache& c = caches_(batch.Size());
  Net::Cache& critic = c.value.critic;
  OptionForward(batch.s, batch.o_prev, batch.init, When::kUpdate, c.p);
  critic_->Forward(batch.s, critic);
  option_log_.LogProb(c.p, batch.o, c.logp);
  ClippedSurrogate(c.logp, batch.high.logp_old, batch.high.adv_hat, clip_, terms, c.dlogp);
  terms.entropy = option_log_.MeanEntropy(c.p);
  c.value.v = batch.P_old.cwiseProduct(critic.out).colwise().sum().transpose();
  ValueLoss(c.value.v, batch.high.ret, terms, c.value.dv);
  terms.total = terms.surrogate - w_ * terms.entropy + terms.value;

  option_log_.Backward(c.p, batch.o, c.dlogp, -w_, c.dp);
  OptionBackward(batch.s, batch.o_prev, batch.init, c.dp);
  critic.dout = batch.P_old * c.value.dv.asDiagonal();
  critic_->Backward(batch.s, critic);
  return terms;
}

LossTerms DoubleActorCritic::LowLoss(const Batch& batch) {
  LossTerms terms;
  Cache& c = caches_(batch.Size());
  ActionLogProb(*policy_, batch, c.action);
  ActionSurrogate(*policy_, batch, switches_.density_log_eps, clip_, terms, c.action);
  terms.entropy = GaussianMeanEntropy(c.action.policy.sigma);
  EntryValueLoss(*critic_, batch.s, batch.o, batch.low.ret, terms, c.value);
  terms.total = terms.surrogate + terms.value;
  return terms;
}

const std::vector<Ratio>& DoubleActorCritic::Update() {
  const int first = order_rng_.Uniform() < 0.5 ? kHigh : kLow;  // fair coin; spec 4.6 (f)
  for (const int stage : {first, 1 - first}) {
    rollout_.ForEpochs(shuffle_rng_, [&](const Batch& batch) { Learn(stage, batch); });
  }
  return Report();
}

void DoubleActorCritic::OptionPolicy(const Mat& s, const std::vector<int>& o_prev,
                                     const std::vector<char>& init, Mat& P) {
  OptionForward(s, o_prev, init, When::kActing, P);
  NormalizeColumns(P);
}

}  // namespace o2v
