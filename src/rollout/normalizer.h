#pragma once
// Running mean and variance of the states.

#include <string_view>

#include "base/state.h"
#include "base/types.h"

namespace o2v {

/// Running mean and population variance in double, shared by all workers, never reset.
/// Source: spec 1.2 (parallel update of Chan et al. 1979).
class Normalizer {
 public:
  explicit Normalizer(Index size);

  /// Takes in a batch x (S, N), raw observations.
  void Update(const MatD& x);
  /// out (S) = clip((x - mean) / sqrt(var + 1e-8), -10, 10) of one raw observation x (S).
  void Apply(const Eigen::Ref<const VecD>& x, Eigen::Ref<Vec> out) const;

  const VecD& mean() const { return mean_; }
  const VecD& var() const { return var_; }
  double count() const { return count_; }
  /// Statistics from elsewhere; sizes must be S.
  void Set(const VecD& mean, const VecD& var, double count);

  /// `normalizer.mean`, `.var`, `.count`.
  void Serialize(StateVisitor& v);

 private:
  VecD mean_, var_;
  double count_ = 1e-4;  // prior weight of mean 0, variance 1; spec 1.2
  VecD inv_std_;         // 1 / sqrt(var + 1e-8), kept beside var_
};

}  // namespace o2v
