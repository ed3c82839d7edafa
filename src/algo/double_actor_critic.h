#pragma once
// The two augmented MDPs of DAC and their two-stage PPO, for any option policy.

#include "algo/method.h"
#include "algo/option_policy.h"
#include "algo/ppo_core.h"

namespace o2v {

/// Double actor-critic: the high MDP acts by options o_t at (s_t, o_{t-1}), the low one by actions
/// a_t at (s_t, o_t); one critic q(s) in R^K serves both. With p the option policy's vector over
/// options (which some switches leave unnormalised):
///
///   high  L = clip-surrogate(ln p_o) - w mean H(p) + 1/2 mean (sum_k p_k^old q_k - R^high)^2
///   low   L = clip-surrogate(ln pi_o(a | s)) + 1/2 mean (q_o - R^low)^2
///
/// Values v^high_t = sum_k p_k q_k, v^low_t = q_o. After each rollout both stages in random order,
/// with one Adam. A method brings its option policy. Source: spec 4.6.
class DoubleActorCritic : public Method {
 public:
  void Collect(VecEnv& env, std::vector<Episode>& episodes) override;
  const std::vector<Ratio>& Update() override;
  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override;
  LossTerms Loss(int stage, const Batch& batch, const FixedDraws* fixed) override;

 protected:
  /// When the option policy is asked: the loss may see another policy than the one that acted.
  enum class When { kActing, kUpdate };

  explicit DoubleActorCritic(const AlgorithmInput& in);
  /// Assemble for both stages. The critic's output is q. in_option_policy: whether the parameter of
  /// this name belongs to the option policy.
  void AssembleStages(const AlgorithmInput& in, std::vector<Param*> params,
                      const Reaches& in_option_policy, OptionPolicies* policy, Net* critic);

  /// s (S, B), o_prev, init (B) -> p (K, B).
  virtual void OptionForward(const ConstMatRef& s, std::span<const int> o_prev,
                             std::span<const char> init, When when, Mat& p) = 0;
  /// dp = dL/dp (K, B) of the last OptionForward, same arguments. Adds to the gradients.
  virtual void OptionBackward(const ConstMatRef& s, std::span<const int> o_prev,
                              std::span<const char> init, const Mat& dp) = 0;

 private:
  enum Stage { kHigh = 0, kLow = 1 };

  /// What a batch of B samples leaves behind.
  struct Cache {
    ActionCache action;
    ValueCache value;    // value.critic.out is q (K, B)
    Mat p, dp;           // (K, B)
    std::vector<int> o;  // (B)
    Vec logp, dlogp;     // (B) ln p_o
  };

  LossTerms HighLoss(const Batch& batch);
  LossTerms LowLoss(const Batch& batch);

  const double w_;     // entropy weight of the high stage
  const double clip_;  // c
  const OptionLog option_log_;
  Rng &policy_rng_ = NewStream("policy"), &bootstrap_rng_ = NewStream("bootstrap"),
      &shuffle_rng_ = NewStream("shuffle"), &order_rng_ = NewStream("order");
  PpoRollout rollout_;
  CacheByWidth<Cache> caches_;
};

}  // namespace o2v
