#pragma once
// The optimiser: global-norm clipping and Adam.

#include <span>
#include <string>
#include <vector>

#include "base/state.h"
#include "nn/param.h"

namespace o2v {

/// Global Euclidean norm of all gradients.
double GradNorm(std::span<Param* const> params);

/// g * min(1, clip / (norm + 1e-6)): the factor. Source: spec 1.4.
double ClipFactor(double norm, double clip_norm);

/// What happens to a tensor that the current loss does not involve. Source: spec 1.4.
enum class IdleRule {
  kSkip,          // nothing
  kZeroGradient,  // once it has had a gradient: a step with gradient zero, momentum included
};

/// Adam with one step counter a tensor: w -= lr m_hat / (sqrt(v_hat) + eps), m_hat = m / (1 -
/// beta1^t), v_hat = v / (1 - beta2^t). Source: spec 1.4 (Kingma & Ba 2015, the form of torch
/// >= 1.3).
class Adam {
 public:
  struct Options {
    double learning_rate, beta1, beta2, eps, clip_norm;
  };
  /// Keeps pointers to `params`.
  Adam(std::vector<Param*> params, const Options& options);

  /// Clips the gradients by their global norm, takes one step and zeroes the gradients. Returns the
  /// norm before clipping. in_graph[i]: the loss involves tensor i (the gradients of the others are
  /// zero); the others follow the idle rule.
  double Step(std::span<const char> in_graph, IdleRule idle);

  /// Tensor i is never stepped again, whatever the idle rule; its gradient must be zero from now
  /// on.
  void Freeze(std::size_t i) { frozen_.at(i) = 1; }

  /// Moments `adam.m.<name>`, `adam.v.<name>` and the counters `adam.t`.
  void Serialize(StateVisitor& v);

 private:
  std::vector<Param*> params_;
  Options options_;
  std::vector<Mat> m_, v_;
  std::vector<std::int64_t> t_;  // steps of each tensor; 0: never had a gradient
  std::vector<char> frozen_;
};

}  // namespace o2v
