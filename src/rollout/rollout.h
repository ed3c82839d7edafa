#pragma once
// What T steps of N workers leave behind, with the advantages and value targets of each critic.

#include <span>
#include <vector>

#include "rollout/batch.h"
#include "rollout/vec_env.h"

namespace o2v {

/// One critic's rewards, values and targets over a rollout of T steps of N workers; a column is a
/// step. In memory order v has the value of every sample and then those of the N states after it.
struct CriticTargets {
  MatD r;         // (N, T) rewards; where a time limit is bootstrapped, r + gamma v(s_last)
  MatD v;         // (N, T + 1)
  MatD adv, ret;  // (N, T)

  CriticTargets(int N, int T) : r(MatD::Zero(N, T)), v(MatD::Zero(N, T + 1)), adv(r), ret(r) {}
};

/// Masks of a step of all workers, mask (N, T) 0 where an episode ended, into column t; true when
/// one of them ended by its time limit only.
bool RecordEnds(const Transition& transition, int t, MatD& mask);

/// n entries of an array that has one per sample, from `first` on.
template <typename T>
std::span<const T> Entries(const std::vector<T>& x, Index first, Index n) {
  return std::span<const T>(x).subspan(std::size_t(first), std::size_t(n));
}

/// A rollout of T steps of N workers with one critic, whose advantages and targets are
/// batch.action, or with two, of which the first one's are batch.option. Source: spec 1.3.
struct Rollout {
  Batch batch;  // T N samples, time-major
  MatD mask;    // (N, T) 0 where an episode ended
  std::vector<CriticTargets> critics;

  Rollout(Index S, Index A, int N, int T, int n_critics);

  /// The rewards and masks of step t. True when a worker ended by its time limit only.
  bool RecordStep(const Transition& transition, int t);
  /// r += gamma v(s_last) of step t where an episode ended by its time limit only; v(s_last) is the
  /// last column of the critics' v.
  void BootstrapTimeLimits(const Transition& transition, int t, double gamma);
  /// Advantages, normalised with `adv_std_eps`, and returns of every critic, into the batch.
  void MakeTargets(double gamma, double lambda, double adv_std_eps);
};

}  // namespace o2v
