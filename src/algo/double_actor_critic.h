#pragma once
// The two augmented MDPs of DAC and their two-stage PPO, for any option policy.

#include <memory>
#include <string>
#include <vector>

#include "algo/algorithm.h"
#include "algo/option_nets.h"
#include "algo/option_policy.h"
#include "algo/ppo_core.h"
#include "algo/surrogate.h"

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
class DoubleActorCritic : public Algorithm {
 public:
  void Collect(VecEnv& env, std::vector<Episode>& episodes) override;
  void Update(std::vector<double>& stats) override;
  std::vector<std::string> StatNames() const override;
  void Visit(StateVisitor& v) override;

  int NumOptions() const override { return int(K_); }
  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override;
  void ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) override;
  void OptionValues(const Mat& s, const std::vector<int>& o, Mat& q) override;

  std::vector<std::string> Stages() const override { return {"high", "low"}; }
  LossTerms Loss(int stage, const Batch& batch, const FixedDraws* fixed) override;
  double Step(int stage) override;
  std::vector<char> InGraph(int stage) const override { return in_graph_[std::size_t(stage)]; }

 protected:
  /// When the option policy is asked: the loss may see another policy than the one that acted.
  enum class Asked { kActing, kUpdate };

  explicit DoubleActorCritic(const AlgorithmInput& in);
  /// Closes construction, when the method's networks exist: pointers to them are kept. The critic's
  /// output is q. in_high, in_low: whether a stage's loss involves a parameter, by its name.
  void Assemble(OptionPolicies& policy, Net& critic, bool (*in_high)(const std::string& name),
                bool (*in_low)(const std::string& name));

  /// s (S, B), o_prev, init (B) -> p (K, B).
  virtual void OptionForward(const ConstMatRef& s, std::span<const int> o_prev,
                             std::span<const char> init, Asked asked, Mat& p) = 0;
  /// dp = dL/dp (K, B) of the last OptionForward, same arguments. Adds to the gradients.
  virtual void OptionBackward(const ConstMatRef& s, std::span<const int> o_prev,
                              std::span<const char> init, const Mat& dp) = 0;

  const PpoHyper hyper_;
  const Switches switches_;

 private:
  enum Stage { kHigh = 0, kLow = 1 };

  /// What a batch of B samples leaves behind.
  struct Cache {
    Net::Cache critic;  // out is q (K, B)
    OptionPolicies::Cache policy;
    Mat p, dp;                          // (K, B)
    std::vector<int> o;                 // (B)
    Vec logp, dlogp, log_slope, v, dv;  // (B)
  };

  /// p, a drawn option and the option values at states s.
  void Evaluate(const Mat& s, std::span<const char> init, Cache& c);
  LossTerms HighLoss(const Batch& batch);
  LossTerms LowLoss(const Batch& batch);
  void RunStage(int stage);

  const double w_;  // entropy weight of the high stage
  const Index K_;
  const int N_;
  const OptionLog option_log_;
  OptionPolicies* policy_ = nullptr;  // the method's
  Net* critic_ = nullptr;
  Rng policy_rng_, bootstrap_rng_, shuffle_rng_, order_rng_;
  std::unique_ptr<Adam> adam_;
  std::vector<char> in_graph_[2];

  Batch rollout_;  // T N samples
  MatD mask_;      // (N, T)
  CriticStream high_, low_;
  std::vector<int> o_prev_;        // (N)
  std::vector<char> not_initial_;  // (N) zeros
  CacheByWidth<Cache> caches_;
  Mat a_;  // (A, N)
  Transition transition_;
  Minibatches minibatches_;
  OptionUsage usage_;
  LossMeans means_[2];
};

}  // namespace o2v
