#pragma once
// What a fixed policy earns, and what its networks say.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "algo/algorithm.h"
#include "base/csv.h"
#include "env/env.h"
#include "rollout/normalizer.h"

namespace o2v {

/// One evaluated episode.
struct EvalEpisode {
  double ret;  // undiscounted sum of raw rewards
  int length;  // [environment steps]
};

/// A step that has been made.
struct EvalStep {
  int episode, t;             // both from 0
  const VecD& obs;            // (S) the state as the task gave it,
  const Mat& s;               // (S, 1) normalised
  const Mat& P;               // (K, 1) what the option was drawn with
  int o;                      // executed
  std::span<const double> a;  // (A) as the task took it: clipped
  double reward;
};
using StepHook = std::function<void(const EvalStep&)>;

/// Runs whole episodes with frozen networks and statistics. Options are drawn from the option
/// policy; actions from the Gaussian, or its mean when `sample_action` is false. The same seed
/// gives the same episodes: all randomness comes from streams "eval.*" of `seed`. `stop` is asked
/// before each step; when it says true, the episodes that have ended are returned. `visit` is
/// called after each.
std::vector<EvalEpisode> Evaluate(Policy& policy, const Normalizer& normalizer, Env& env,
                                  int episodes, bool sample_action, std::uint64_t seed,
                                  const StepHook& visit = {},
                                  const std::function<bool()>& stop = {});

/// A table of steps: episode, step, o, P0.. (K), a0.. (A), reward, obs0.. (S).
CsvTable NewTrajectory(const EnvSpec& spec, int K);
void Append(const EvalStep& step, CsvTable& trajectory);

/// Network outputs for given inputs, dropout off. Reads a CSV with the columns s0.. (S, normalised
/// state), o_prev, init, o (0-based; the option fed to action net and critic), in any order, and
/// writes one with P0.. (K), mu0.. (A), sigma0.. (A), q0.. (K), a row each. Throws Error for other
/// columns, options outside [0, K) and flags other than 0 and 1.
void Forward(Policy& policy, const EnvSpec& spec, const std::filesystem::path& input,
             const std::filesystem::path& output);

}  // namespace o2v
