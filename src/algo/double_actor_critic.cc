#include "algo/double_actor_critic.h"

#include "dist/categorical.h"
#include "dist/diag_gaussian.h"

namespace o2v {

DoubleActorCritic::DoubleActorCritic(const AlgorithmInput& in)
    : TwoStageMethod(in),
      w_(in.hyper->Real("entropy_weight")),
      clip_(in.hyper->Real("ratio_clip")),
      option_log_(in.switches.density_log_eps) {}

void DoubleActorCritic::RegisterStages(const AlgorithmInput& in, std::vector<Param*> all,
                                       std::vector<Param*> option_policy,
                                       IntraOptionPolicies* policy, Mlp* critic) {
  std::vector<Param*> action_policy;
  for (Index k = 0; k < K_; ++k) Append(action_policy, policy->Params(k));
  Append(option_policy, critic->Params());
  Append(action_policy, critic->Params());
  RegisterNetworks(in, std::move(all), {option_policy, action_policy}, policy, critic);
}

DoubleActorCritic::OptionDistribution DoubleActorCritic::Options(const ConstMatRef& s,
                                                                 std::span<const int> o_prev,
                                                                 std::span<const char> init) {
  Cache& c = caches_(s.cols());
  OptionForward(s, o_prev, init, When::kActing, c.p);
  option_log_.Log(c.p, c.log_p);
  return {c.p, c.log_p};
}

void DoubleActorCritic::DrawActions(const ConstMatRef& s, std::span<const int> o, Mat& a,
                                    Vec& logp) {
  ActionCache& c = caches_(s.cols()).action;
  SampleAction(*policy_, s, o, policy_rng_, a, c);
  LogDensity(switches_.density_log_eps, c.logp, c.slope);
  logp = c.logp;
}

const Mat& DoubleActorCritic::Critic(const ConstMatRef& s, std::span<const int>) {
  Mlp::Cache& c = caches_(s.cols()).value.critic;
  critic_->Forward(s, c);
  return c.out;
}

LossTerms DoubleActorCritic::OptionLoss(const Batch& batch, const FixedDraws*) {
  LossTerms terms;
  Cache& c = caches_(batch.Size());
  Mlp::Cache& critic = c.value.critic;
  OptionForward(batch.s, batch.o_prev, batch.init, When::kUpdate, c.p);
  critic_->Forward(batch.s, critic);
  option_log_.Log(c.p, c.log_p);
  PickEntries(c.log_p, batch.o, c.logp_taken);
  ClippedSurrogate(c.logp_taken, batch.option.logp_old, batch.option.adv_hat, clip_, terms,
                   c.dlogp_taken);
  terms.entropy = MeanEntropy(c.p, c.log_p);
  c.value.v = batch.P_old.cwiseProduct(critic.out).colwise().sum().transpose();
  ValueLoss(c.value.v, batch.option.ret, terms, c.value.dv);
  terms.total = terms.surrogate - w_ * terms.entropy + terms.value;

  option_log_.Backward(c.p, batch.o, c.dlogp_taken, -w_, c.dp);
  OptionBackward(batch.s, batch.o_prev, batch.init, c.dp);
  critic.dout = batch.P_old * c.value.dv.asDiagonal();
  critic_->Backward(batch.s, critic);
  return terms;
}

LossTerms DoubleActorCritic::ActionLoss(const Batch& batch, const FixedDraws*) {
  LossTerms terms;
  Cache& c = caches_(batch.Size());
  ActionLogProb(*policy_, batch, c.action);
  ActionSurrogate(*policy_, batch, switches_.density_log_eps, clip_, terms, c.action);
  terms.entropy = GaussianMeanEntropy(c.action.policy.sigma);
  EntryValueLoss(*critic_, batch.s, batch.o, batch.action.ret, terms, c.value);
  terms.total = terms.surrogate + terms.value;
  return terms;
}

void DoubleActorCritic::OptionPolicy(const Mat& s, const std::vector<int>& o_prev,
                                     const std::vector<char>& init, Mat& P) {
  OptionForward(s, o_prev, init, When::kActing, P);
  NormalizeColumns(P);
}

}  // namespace o2v
