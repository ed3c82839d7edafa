#pragma once
// What the PPO-type methods share beside the losses: their numbers, the rollout's arrays and the
// caches.

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "algo/algorithm.h"
#include "nn/adam.h"
#include "rollout/gae.h"

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

/// One critic's rewards and values over a rollout of T steps of N workers; a column is a step.
struct CriticStream {
  MatD r;         // (N, T) rewards; where a time limit is bootstrapped, r + gamma v(s_last)
  MatD v;         // (N, T + 1)
  MatD adv, ret;  // (N, T)

  CriticStream(int N, int T) : r(MatD::Zero(N, T)), v(MatD::Zero(N, T + 1)), adv(r), ret(r) {}
  /// GAE, normalised advantages and targets into `out`. Source: spec 1.3.
  void Finish(const MatD& mask, const PpoHyper& hyper, double adv_std_eps, Stream& out);
};

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
