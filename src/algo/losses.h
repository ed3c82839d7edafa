#pragma once
// Losses that the methods share.

#include <span>

#include "algo/algorithm.h"
#include "algo/option_nets.h"

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

// ---- With one network per option ----------------------------------------------------------------

/// What acting by options o, or a loss on it, leaves behind.
struct ActionCache {
  IntraOptionPolicies::Cache policy;
  Vec logp, dlogp, slope;  // (B) ln pi_o(a | s), its adjoint, its slope under density_log_eps
};

/// s (S, N), o (N) -> a (A, N) ~ pi_o and c.logp.
void SampleAction(const IntraOptionPolicies& policy, const ConstMatRef& s, std::span<const int> o,
                  Rng& rng, Mat& a, ActionCache& c);

/// c.logp of a batch.
void ActionLogProb(const IntraOptionPolicies& policy, const Batch& batch, ActionCache& c);

/// Clipped surrogate of the density e^{c.logp} on batch.action under density_log_eps. c.logp is
/// what ActionLogProb left, with the logarithms of other factors added or not; c.dlogp becomes its
/// adjoint. Adds to the gradients of the policies.
void ActionSurrogate(IntraOptionPolicies& policy, const Batch& batch, Fidelity density_log_eps,
                     double clip, LossTerms& terms, ActionCache& c);

/// v[b] = x_k of the critic's outputs x at s (S, B), k (B).
void EntryValues(const Mlp& critic, const ConstMatRef& s, std::span<const int> k, Mlp::Cache& c,
                 double* v);

/// What a value loss leaves behind.
struct ValueCache {
  Mlp::Cache critic;
  Vec v, dv;  // (B)
};

/// 1/2 mean (x_k - ret)^2 of the critic's outputs x at s (S, B), k (B). Adds to the gradients.
void EntryValueLoss(Mlp& critic, const ConstMatRef& s, std::span<const int> k, const Vec& ret,
                    LossTerms& terms, ValueCache& c);

}  // namespace o2v
