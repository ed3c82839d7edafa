#pragma once
// Batches, a toy task and what a test does to a method; for both precisions.

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "algo/algorithm.h"
#include "base/check.h"
#include "random_mat.h"
#include "rollout/vec_env.h"

namespace o2v {

inline EnvSpec Sizes(int S, int A) {
  EnvSpec spec;
  spec.S = S;
  spec.A = A;
  return spec;
}

/// B samples, steps of two workers, with some initial flags, ratios and advantages on all sides,
/// and all that any method reads: P_old a distribution, every fourth sample a continued option,
/// episodes that end before first states.
inline Batch RandomBatch(Index S, Index A, int K, Index B, Rng& rng) {
  constexpr Index kWorkers = 2;
  Batch batch;
  batch.Resize(S, A, B);
  batch.s = RandomMat(S, B, rng);
  batch.a = RandomMat(A, B, rng);
  batch.o = RandomOptions(std::size_t(B), K, rng);
  batch.o_prev = RandomOptions(std::size_t(B), K, rng);
  batch.stop.assign(std::size_t(B), 1);
  batch.mask = VecD::Ones(B);
  for (Index b = 0; b < B; ++b) {
    const std::size_t i = std::size_t(b);
    batch.init[i] = b % 4 == 0;
    if (b % 4 == 2) {
      batch.stop[i] = 0;
      batch.o[i] = batch.o_prev[i];
    }
    if (batch.init[i] && b >= kWorkers) batch.mask(b - kWorkers) = 0;
  }
  for (StageTargets* targets : {&batch.option, &batch.action}) {
    targets->logp_old = RandomMat(B, 1, rng, 0.2).array() - Real(2);
    targets->adv_hat = RandomMat(B, 1, rng);
    targets->ret = RandomMat(B, 1, rng);
  }
  batch.r = RandomMat(B, 1, rng).cast<double>();
  batch.s_end = RandomMat(S, kWorkers, rng);
  batch.P_old = RandomMat(K, B, rng).array().exp();
  for (Index b = 0; b < B; ++b) batch.P_old.col(b) /= batch.P_old.col(b).sum();
  return batch;
}

inline Param& FindParam(Algorithm& algorithm, const std::string& name) {
  for (Param* p : algorithm.Params()) {
    if (p->name == name) return *p;
  }
  throw Error("no parameter " + name);
}

/// A point on a line, to be kept near 0: x <- x + 0.1 a, reward -scale |x|; starts in U(-1, 1),
/// ends by its time limit only.
class PointEnv final : public Env {
 public:
  explicit PointEnv(int time_limit, double scale = 1) : scale_(scale) {
    spec_.id = "Point";
    spec_.S = spec_.A = 1;
    spec_.time_limit = time_limit;
    spec_.a_low = {-1};
    spec_.a_high = {1};
  }

  const EnvSpec& Spec() const override { return spec_; }
  void Reset(Rng& rng, std::span<double> obs) override {
    obs[0] = x_ = rng.Uniform(-1, 1);
    steps_ = 0;
  }
  StepResult Step(std::span<const double> a, std::span<double> obs) override {
    obs[0] = x_ = std::clamp(x_ + 0.1 * a[0], -2.0, 2.0);
    return {-scale_ * std::abs(x_), false, ++steps_ == spec_.time_limit};
  }
  void Serialize(StateVisitor&, const std::string&) override {}

 private:
  EnvSpec spec_;
  double scale_, x_ = 0;
  int steps_ = 0;
};

/// `workers` points whose first episodes have begun.
inline VecEnv PointTask(int workers, int time_limit, double scale = 1) {
  VecEnv env([=] { return std::make_unique<PointEnv>(time_limit, scale); }, workers, /*seed=*/3);
  env.Reset();
  return env;
}

/// One rollout and the update on it; the update's statistics.
inline std::vector<double> Iterate(Algorithm& algorithm, VecEnv& env) {
  std::vector<Episode> episodes;
  algorithm.Collect(env, episodes);
  std::vector<double> stats;
  for (const SumAndCount& ratio : algorithm.Update()) stats.push_back(ratio.Value());
  return stats;
}

/// The update's number of a name of StatNames().
inline double Stat(const Algorithm& algorithm, const std::vector<double>& stats,
                   const std::string& name) {
  const std::vector<std::string> names = algorithm.StatNames();
  const auto found = std::find(names.begin(), names.end(), name);
  Check(found != names.end(), "no statistic ", name);
  return stats[std::size_t(found - names.begin())];
}

}  // namespace o2v
