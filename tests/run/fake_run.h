#pragma once
// A task and a method small enough to train in microseconds, with state of every kind, for the
// tests of the harness.

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "algo/algorithm.h"
#include "base/files.h"
#include "env/env.h"
#include "run/config.h"
#include "run/metrics.h"
#include "run/trainer.h"
#include "test_folder.h"

namespace o2v {

/// A point on a line that is pushed about: reward -x^2, ends beyond |x| = 2 or after 7 steps.
class FakeEnv final : public Env {
 public:
  const EnvSpec& Spec() const override { return spec_; }

  void Reset(Rng& rng, std::span<double> obs) override {
    x_ = rng.Uniform(-1, 1);
    steps_ = 0;
    Observe(obs);
  }
  StepResult Step(std::span<const double> a, std::span<double> obs) override {
    x_ += a[0];
    ++steps_;
    Observe(obs);
    return {-x_ * x_, std::abs(x_) > 2, steps_ == spec_.time_limit};
  }
  void Serialize(StateVisitor& v, const std::string& prefix) override {
    v.Double(prefix + "x", x_);
    v.Int(prefix + "steps", steps_);
  }

 private:
  void Observe(std::span<double> obs) const {
    obs[0] = x_;
    obs[1] = steps_;
  }

  EnvSpec spec_{"Fake-v0", 2, 1, 7, {-1}, {1}};
  double x_ = 0;
  int steps_ = 0;
};

/// Acts with a random linear policy and learns by nudging it at random, by the returns.
class FakeAlgorithm : public Algorithm {
 public:
  static constexpr int kRollout = 5;  // steps a worker

  FakeAlgorithm(const EnvSpec& spec, std::uint64_t seed)
      : rng_(seed, "fake"), W_("actor.W", spec.A, spec.S), b_("actor.b", spec.A, 1) {
    for (Index i = 0; i < W_.value.size(); ++i) W_.value(i) = static_cast<Real>(rng_.Normal());
  }

  std::function<void()> in_update;  // called in every Update

  void Collect(VecEnv& env, std::vector<Episode>& episodes) override {
    reward_ = 0;
    for (int t = 0; t < kRollout; ++t) {
      Mat a = W_.value * env.States();
      for (Index i = 0; i < a.size(); ++i) a(i) += b_.value(0) + static_cast<Real>(rng_.Normal());
      env.Step(a, transition_, episodes);
      reward_ += transition_.r.sum();
    }
  }
  const std::vector<SumAndCount>& Update() override {
    if (in_update) in_update();
    const double nudge = 0.01 * reward_ * rng_.Normal();
    W_.value.array() += static_cast<Real>(nudge);
    b_.value.array() -= static_cast<Real>(nudge);
    ++updates_;
    return ratios_ = {{reward_, 1}, {nudge, 1}};
  }
  std::vector<std::string> StatNames() const override { return {"reward", "nudge"}; }
  std::vector<Param*> Params() override { return {&W_, &b_}; }
  void Serialize(StateVisitor& v) override {
    for (Param* p : Params()) v.Matrix(p->name, p->value);
    v.Int("updates", updates_);
    rng_.Serialize(v, "policy_rng");
  }

  int NumOptions() const override { return 2; }
  /// P(o = 1) is 0.25 after option 0, 0.75 after option 1, and a half at the start.
  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override {
    P.resize(2, s.cols());
    for (Index b = 0; b < s.cols(); ++b) {
      const std::size_t i = static_cast<std::size_t>(b);
      P(1, b) = init[i] ? Real(0.5) : o_prev[i] ? Real(0.75) : Real(0.25);
      P(0, b) = 1 - P(1, b);
    }
  }
  /// mu = W s + b + o, sigma = 0.5.
  void ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) override {
    mu = W_.value * s;
    for (Index b = 0; b < s.cols(); ++b) {
      mu(0, b) += b_.value(0) + static_cast<Real>(o[static_cast<std::size_t>(b)]);
    }
    sigma.setConstant(1, s.cols(), Real(0.5));
  }
  /// q = (s0, s1 + o).
  void OptionValues(const Mat& s, const std::vector<int>& o, Mat& q) override {
    q = s;
    for (Index b = 0; b < s.cols(); ++b) q(1, b) += static_cast<Real>(o[std::size_t(b)]);
  }

  std::vector<std::string> StageNames() const override { return {"all"}; }
  LossTerms Loss(int, const Batch&, const FixedDraws*) override { return {}; }
  double Step(int) override { return 0; }
  std::vector<char> InGraph(int) const override { return {1, 1}; }

 private:
  Rng rng_;
  Param W_, b_;
  Transition transition_;
  double reward_ = 0;
  std::vector<SumAndCount> ratios_;
  std::int64_t updates_ = 0;
};

inline RunConfig FakeConfig() {
  RunConfig config;
  config.task = "Fake-v0";
  config.algorithm = "fake";
  config.seed = 3;
  config.steps = 200;
  config.workers = 2;
  config.checkpoint_every = 30;  // every third rollout of 5 x 2 steps
  config.eval_every = 50;
  config.eval_episodes = 2;
  config.switches = SwitchesFor(config.fidelity);
  return config;
}

inline RunParts FakeParts(const RunConfig& config) {
  return {[](int) { return std::make_unique<FakeEnv>(); },
          [seed = config.seed](const EnvSpec& spec) {
            return std::make_unique<FakeAlgorithm>(spec, seed);
          }};
}

/// n episodes of 100 steps with returns 1, 2, ..., n.
inline std::vector<CurvePoint> Rising(int n) {
  std::vector<CurvePoint> episodes;
  for (int i = 1; i <= n; ++i) episodes.emplace_back(100 * i, i);
  return episodes;
}

/// The files of a run folder for which byte equality is promised.
inline const std::vector<std::string> kPromised = {"config.toml", "episodes.csv", "updates.csv",
                                                   "evals.csv", "last.ckpt"};

}  // namespace o2v
