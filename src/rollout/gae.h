#pragma once
// Advantages and value targets.

#include "base/types.h"

namespace o2v {

/// Generalised advantages and lambda = 1 returns of one critic stream, double throughout.
/// r, mask (N, T): a column is one step of all workers, so that the flat order is time-major;
/// v (N, T+1), its last column the value after the rollout -> adv, ret (N, T).
///   delta_t = r_t + gamma m_t v_{t+1} - v_t,  A_t = delta_t + gamma lambda m_t A_{t+1},
///   R_t = r_t + gamma m_t R_{t+1},  R_T = v_T.
/// A time limit that is bootstrapped (`timelimit` = paper) comes as mask 0 and r_t + gamma
/// v(s_last). Throws Error when shapes disagree. Source: spec 1.3; Schulman et al. 2016, Eq. (16).
/// The return is not adv + v, on purpose.
void Gae(const MatD& r, const MatD& mask, const MatD& v, double gamma, double lambda, MatD& adv,
         MatD& ret);

/// (A - mean A) / (std A + std_eps) over all entries, divisor n - 1 -> adv_hat (n) in flat order.
/// `std_eps` is the switch adv_std_eps: paper 1e-8, released 0. Source: spec 1.3.
void NormalizeAdvantages(const MatD& adv, double std_eps, Vec& adv_hat);

}  // namespace o2v
