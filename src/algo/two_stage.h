#pragma once
// The two-stage PPO that DAC+PPO, DAC-OneStep and Option2Vec share.

#include "algo/ppo_method.h"

namespace o2v {

/// An option method seen as two MDPs: one acts by options o_t at (s_t, o_{t-1}), the other by
/// actions a_t at (s_t, o_t). One critic q(s) in R^K serves both, with the values
///
///   v^option_t = sum_k P_k q_k,   v^action_t = q_o.
///
/// After each rollout both stages learn, in random order, with one Adam. A method brings its
/// networks and the losses of both stages. Source: spec 4.6, 4.8; Zhang & Whiteson 2019.
class TwoStageMethod : public PpoMethod {
 public:
  LossTerms Loss(int stage, const Batch& batch, const FixedDraws* fixed) final {
    return stage == kOption ? OptionLoss(batch, fixed) : ActionLoss(batch, fixed);
  }

 protected:
  enum Stage { kOption = 0, kAction = 1 };  // "high" and "low" in updates.csv, DAC's words

  /// (K, B) what an option is drawn with, not always normalised, and its logarithm. Valid until
  /// Options is called again with the same number of states.
  struct OptionDistribution {
    const Mat &P, &log_P;
  };

  explicit TwoStageMethod(const AlgorithmInput& in);

  /// s (S, B), o_prev, init (B) -> the option policy that acts.
  virtual OptionDistribution Options(const ConstMatRef& s, std::span<const int> o_prev,
                                     std::span<const char> init) = 0;
  /// s (S, N), o (N) -> a (A, N), drawn, and its log-densities logp (N).
  virtual void DrawActions(const ConstMatRef& s, std::span<const int> o, Mat& a, Vec& logp) = 0;
  /// s (S, B), o (B) the options fed to the critic, where it is fed -> q (K, B).
  virtual const Mat& Critic(const ConstMatRef& s, std::span<const int> o) = 0;
  virtual LossTerms OptionLoss(const Batch& batch, const FixedDraws* fixed) = 0;
  virtual LossTerms ActionLoss(const Batch& batch, const FixedDraws* fixed) = 0;

 private:
  void Act(const Mat& s, std::span<const char> init, Index first) final;
  Choices DrawForBootstrap(const Mat& s, std::span<const char> init) final;
  void Values(const Choices& x, Index first) final;

  Rng& bootstrap_rng_ = NewStream("bootstrap");
  std::vector<int> o_;  // (N)
  Vec logp_;            // (N)
};

}  // namespace o2v
