#pragma once
// Losses that the PPO-type methods share.

#include "algo/algorithm.h"

namespace o2v {

/// Clipped surrogate -(1/B) sum_b min(r_b A_b, clip(r_b, 1-c, 1+c) A_b), r_b = exp(logp -
/// logp_old). logp, logp_old, adv_hat (B) -> terms.surrogate, .kl, .clip_fraction and dlogp (B),
/// the adjoint of logp:
///   -(1/B) g_b r_b A_b, g_b = 1 if (A_b >= 0 and r_b <= 1+c) or (A_b < 0 and r_b >= 1-c), else 0.
/// Source: spec 3.2; Schulman et al. 2017, Eq. (7).
void ClippedSurrogate(const Vec& logp, const Vec& logp_old, const Vec& adv_hat, double clip,
                      LossTerms& terms, Vec& dlogp);

/// 1/2 mean (v - ret)^2 -> terms.value and dv (B) = (v - ret) / B.
void ValueLoss(const Vec& v, const Vec& ret, LossTerms& terms, Vec& dv);

/// Mean of the terms of a stage's minibatches.
class LossMeans {
 public:
  void Clear() { *this = LossMeans(); }
  void Add(const LossTerms& terms, double grad_norm);
  /// Appends total, surrogate, value, entropy, kl, clip_fraction, grad_norm, in the order of Names.
  void Report(std::vector<double>& stats) const;
  /// The columns of `stage`.
  static void Names(const std::string& stage, std::vector<std::string>& names);

 private:
  LossTerms sum_;
  double grad_norm_ = 0;
  int n_ = 0;
};

}  // namespace o2v
