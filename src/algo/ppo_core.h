#pragma once
// Rollouts of the PPO-type methods: T steps, advantages and targets, epochs of minibatches.

#include <vector>

#include "algo/algorithm.h"
#include "rollout/minibatch.h"

namespace o2v {

/// One critic's rewards and values over a rollout of T steps of N workers; a column is a step. In
/// memory order v has the value of every sample and then those of the N states after the rollout.
struct CriticStream {
  MatD r;         // (N, T) rewards; where a time limit is bootstrapped, r + gamma v(s_last)
  MatD v;         // (N, T + 1)
  MatD adv, ret;  // (N, T)

  CriticStream(int N, int T) : r(MatD::Zero(N, T)), v(MatD::Zero(N, T + 1)), adv(r), ret(r) {}
};

/// Masks of a step of all workers, mask (N, T) 0 where an episode ended, into column t; true when
/// one of them ended by its time limit only.
bool RecordEnds(const Transition& transition, int t, MatD& mask);

/// Entries row..row+n-1 of an array with an entry a sample.
template <typename T>
std::span<const T> Rows(const std::vector<T>& x, Index row, Index n) {
  return std::span<const T>(x).subspan(std::size_t(row), std::size_t(n));
}

/// A rollout of T steps of N workers with one critic, whose advantages and targets are batch.low,
/// or with two, of which the first one's are batch.high. Source: spec 1.3, 1.4.
class PpoRollout {
 public:
  /// Reads gamma, lambda, rollout, epochs and minibatch.
  PpoRollout(const AlgorithmInput& in, int critics);

  Batch batch;  // T N samples
  Mat a;        // (A, N) the actions that are taken next
  MatD mask;    // (N, T)
  std::vector<CriticStream> critics;

  /// Takes T steps and finishes advantages and targets.
  ///   act(row)             chooses `a` at env.States() and writes what else is kept of it into the
  ///                        batch, at the columns from `row`
  ///   value(row, n)        values of the samples from `row` on into the critics' v
  ///   value_next(s, init)  values of other states s (S, N), after o_prev, into its last column
  template <typename Act, typename Value, typename ValueNext>
  void Collect(VecEnv& env, std::vector<Episode>& episodes, Act&& act, Value&& value,
               ValueNext&& value_next) {
    for (int t = 0; t < T_; ++t) {
      const Index row = Index(t) * N_;
      act(row);
      batch.s.middleCols(row, N_) = env.States();
      batch.a.middleCols(row, N_) = a;
      env.Step(a, transition_, episodes);
      for (CriticStream& critic : critics) critic.r.col(t) = transition_.r;
      if (RecordEnds(transition_, t, mask) && bootstrap_) {
        value_next(transition_.s_last, not_initial_);
        Bootstrap(t);
      }
    }
    for (Index row = 0; row < batch.Size(); row += minibatch_) {  // the critics do not act
      value(row, std::min(Index(minibatch_), batch.Size() - row));
    }
    value_next(env.States(), env.Init());
    Finish();
  }

  /// Values of two critics: v^high = sum_k p_k q_k and v^low = q_o of the samples from `row` on;
  /// p, q (K, n), o (n).
  void SetOptionValues(const ConstMatRef& p, const Mat& q, std::span<const int> o, Index row);

  /// Calls use(minibatch) for the shuffled minibatches of all epochs; the last one of an epoch may
  /// be smaller.
  template <typename Use>
  void ForEpochs(Rng& rng, Use&& use) {
    for (int epoch = 0; epoch < epochs_; ++epoch) {
      ForEachMinibatch(order_, minibatch_, rng, [&](std::span<const int> rows) {
        Batch& some = int(rows.size()) == minibatch_ ? whole_ : rest_;
        Gather(batch, rows, some);
        use(some);
      });
    }
  }

 private:
  /// r + gamma v(s_last) where an episode ended by its time limit only.
  void Bootstrap(int t);
  void Finish();

  const int N_, T_, epochs_, minibatch_;
  const double gamma_, lambda_, adv_std_eps_;
  const bool bootstrap_;           // timelimit
  std::vector<char> not_initial_;  // (N) zeros
  Transition transition_;
  std::vector<int> order_;
  Batch whole_, rest_;
};

}  // namespace o2v
