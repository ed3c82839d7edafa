#pragma once
// The networks and losses of DAC: one network per option, and an option policy of any form.

#include "algo/option_policy.h"
#include "algo/two_stage.h"

namespace o2v {

/// Double actor-critic with intra-option policies of their own. With p the option policy's vector
/// over options (which some switches leave unnormalised):
///
///   option stage  L = clip-surrogate(ln p_o) - w mean H(p)
///                     + 1/2 mean (sum_k p_k^old q_k - R^option)^2
///   action stage  L = clip-surrogate(ln pi_o(a | s)) + 1/2 mean (q_o - R^action)^2
///
/// A method brings its option policy. Source: spec 4.6.
class DoubleActorCritic : public TwoStageMethod {
 public:
  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override;

 protected:
  /// When the option policy is asked: the loss may see another policy than the one that acted.
  enum class When { kActing, kUpdate };

  explicit DoubleActorCritic(const AlgorithmInput& in);
  /// RegisterNetworks for both stages. all: every parameter in the order of the network, the
  /// unused ones included; option_policy: those of the option policy. The critic's output is q.
  void RegisterStages(const AlgorithmInput& in, std::vector<Param*> all,
                      std::vector<Param*> option_policy, IntraOptionPolicies* policy, Mlp* critic);

  /// s (S, B), o_prev, init (B) -> p (K, B).
  virtual void OptionForward(const ConstMatRef& s, std::span<const int> o_prev,
                             std::span<const char> init, When when, Mat& p) = 0;
  /// dp = dL/dp (K, B) of the last OptionForward, same arguments. Adds to the gradients.
  virtual void OptionBackward(const ConstMatRef& s, std::span<const int> o_prev,
                              std::span<const char> init, const Mat& dp) = 0;

 private:
  /// What a batch of B samples leaves behind.
  struct Cache {
    ActionCache action;
    ValueCache value;             // value.critic.out is q (K, B)
    Mat p, log_p, dp;             // (K, B)
    Vec logp_taken, dlogp_taken;  // (B) ln p_o
  };

  OptionDistribution Options(const ConstMatRef& s, std::span<const int> o_prev,
                             std::span<const char> init) override;
  void DrawActions(const ConstMatRef& s, std::span<const int> o, Mat& a, Vec& logp) override;
  const Mat& Critic(const ConstMatRef& s, std::span<const int> o) override;
  LossTerms OptionLoss(const Batch& batch, const FixedDraws* fixed) override;
  LossTerms ActionLoss(const Batch& batch, const FixedDraws* fixed) override;

  const double w_;     // entropy weight of the option stage
  const double clip_;  // c
  const OptionLog option_log_;
  CacheByWidth<Cache> caches_;
};

}  // namespace o2v
