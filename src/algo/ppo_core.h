#pragma once
// What the PPO-type methods share beside the losses: their numbers, the rollout's arrays, the
// epochs over it and the caches.

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "algo/algorithm.h"
#include "nn/activation.h"
#include "nn/adam.h"
#include "rollout/gae.h"
#include "rollout/minibatch.h"

namespace o2v {

/// Numbers of spec 7 that every PPO-type method reads.
struct PpoHyper {
  double gamma, lambda;
  int rollout;        // T, steps a worker
  int epochs;         // of each stage
  int minibatch;      // B
  double ratio_clip;  // c
  Adam::Options adam;

  /// Reads gamma, lambda, rollout, epochs, minibatch, ratio_clip, learning_rate, adam_beta1,
  /// adam_beta2, adam_eps, clip_norm. Throws ConfigError.
  explicit PpoHyper(const Settings& settings);
};

/// Reads learning_rate, adam_beta1, adam_beta2, adam_eps, clip_norm. Throws ConfigError.
Adam::Options ReadAdam(const Settings& settings);

/// One critic's rewards and values over a rollout of T steps of N workers; a column is a step.
struct CriticStream {
  MatD r;         // (N, T) rewards; where a time limit is bootstrapped, r + gamma v(s_last)
  MatD v;         // (N, T + 1)
  MatD adv, ret;  // (N, T)

  CriticStream(int N, int T) : r(MatD::Zero(N, T)), v(MatD::Zero(N, T + 1)), adv(r), ret(r) {}
  /// GAE, normalised advantages and targets into `out`. Source: spec 1.3.
  void Finish(const MatD& mask, const PpoHyper& hyper, double adv_std_eps, Stream& out);
};

/// Masks of a step of all workers, mask (N, T) 0 where an episode ended, into column t; true when
/// one of them ended by its time limit only.
bool RecordEnds(const Transition& transition, int t, MatD& mask);

/// Epochs of shuffled minibatches over a rollout; the last of an epoch may be smaller.
class Minibatches {
 public:
  /// For a rollout of n samples.
  explicit Minibatches(Index n) : order_(std::size_t(n)) {}

  /// Calls use(batch) for every minibatch of every epoch.
  template <typename Use>
  void Run(const Batch& rollout, const PpoHyper& hyper, Rng& rng, Use&& use) {
    for (int epoch = 0; epoch < hyper.epochs; ++epoch) {
      ForEachMinibatch(order_, hyper.minibatch, rng, [&](std::span<const int> rows) {
        Batch& batch = int(rows.size()) == hyper.minibatch ? minibatch_ : rest_;
        Gather(rollout, rows, batch);
        use(batch);
      });
    }
  }

 private:
  std::vector<int> order_;
  Batch minibatch_, rest_;
};

/// How often and how long the options of a rollout were executed.
class OptionUsage {
 public:
  explicit OptionUsage(Index K) : executed_(std::size_t(K), 0), begun_(executed_) {}

  void Clear();
  /// A step with option o, after o_prev or at an episode's start.
  void Count(int o, int o_prev, bool init);
  /// Appends each option's share of the steps, then the mean length [steps] of its segments; the
  /// segment that the rollout's start cuts counts where it began.
  void Report(std::vector<double>& stats) const;
  /// The columns of Report.
  void Names(std::vector<std::string>& names) const;

 private:
  std::vector<double> executed_, begun_;  // (K) steps of each option; its segments
};

/// Options o of a step of all workers into the rollout at `column`, with o_prev and the flags; they
/// are counted and become o_prev.
void RecordOptions(Index column, std::span<const int> o, std::span<const char> init,
                   std::vector<int>& o_prev, Batch& rollout, OptionUsage& usage);

/// `activation` of a method's numbers, tanh or relu.
Activation ReadActivation(const Settings& settings);

/// Scratch matrices by batch width, so that the widths in use (workers, minibatch, a last smaller
/// minibatch) each keep theirs and nothing is resized after their first use.
template <typename Cache>
class CacheByWidth {
 public:
  Cache& operator()(Index width) {
    std::unique_ptr<Cache>& cache = caches_[width];
    if (!cache) cache = std::make_unique<Cache>();
    return *cache;
  }

 private:
  std::map<Index, std::unique_ptr<Cache>> caches_;
};

/// Calls use(start, n) for consecutive column blocks of at most `width` that cover 0..total-1.
template <typename Use>
void ForEachBlock(Index total, Index width, Use&& use) {
  for (Index start = 0; start < total; start += width) use(start, std::min(width, total - start));
}

}  // namespace o2v
