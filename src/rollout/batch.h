#pragma once
// What a loss is computed on: a whole rollout or a minibatch of it.

#include <span>
#include <vector>

#include "base/types.h"

namespace o2v {

/// One critic's view of the samples (DAC: the high or "hat" and the low or "bar" MDP; spec 4.6).
struct StageTargets {
  Vec logp_old;  // (B) log-probability of the choice when it was made
  Vec adv_hat;   // (B) advantage, normalised over the whole rollout
  Vec ret;       // (B) value target, the lambda = 1 return
};

/// B samples; a rollout is flattened time-major (all workers of step 0, then step 1, ...).
struct Batch {
  Mat s;                        // (S, B) normalised states
  Mat a;                        // (A, B) raw (unclipped) actions
  std::vector<int> o, o_prev;   // (B) options, 0-based
  std::vector<char> init;       // (B) flag the option policy is given in the update
  StageTargets option, action;  // single-stage methods use `action`

  // Kept by the methods that need them, else empty.
  Mat P_old;  // (K, B) probabilities that the options were drawn with: two-stage methods
  std::vector<char> stop;  // (B) the previous option was stopped: AHP
  VecD r, mask;  // (B) rewards; 0 where an episode ended: targets that the loss computes (OC, IOPG)
  Mat s_end;     // (S, N) states after the rollout: OC

  Index Size() const { return s.cols(); }
  /// Sizes the arrays that all methods have for B samples.
  void Resize(Index S, Index A, Index B);
};

/// Copies samples `rows` of `all` into `out`, which is resized when needed; P_old and stop as well
/// where `all` has them.
void Gather(const Batch& all, std::span<const int> rows, Batch& out);

}  // namespace o2v
