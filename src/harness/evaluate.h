#pragma once
// What a fixed policy earns, and what its networks say.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "algo/algorithm.h"
#include "env/env.h"
#include "rollout/normalizer.h"

namespace o2v {

/// One evaluated episode.
struct EvalEpisode {
  double ret;  // undiscounted sum of raw rewards
  int length;  // [environment steps]
};

/// Called in a visited state s (S, 1), normalised, with the option o executed there.
using VisitHook = std::function<void(const Mat& s, int o)>;

/// Runs whole episodes with frozen networks and statistics. Options are drawn from the option
/// policy; actions from the Gaussian, or its mean when `sample_action` is false. The same seed
/// gives the same episodes: all randomness comes from streams "eval.*" of `seed`. `stop` is asked
/// before each step; when it says true, the episodes that have ended are returned.
std::vector<EvalEpisode> Evaluate(Policy& policy, const Normalizer& normalizer, Env& env,
                                  int episodes, bool sample_action, std::uint64_t seed,
                                  const VisitHook& visit = {},
                                  const std::function<bool()>& stop = {});

/// Network outputs for given inputs, dropout off. Reads a CSV with the columns s0.. (S, normalised
/// state), o_prev, init, o (0-based; the option fed to action net and critic), in any order, and
/// writes one with P0.. (K), mu0.. (A), sigma0.. (A), q0.. (K), a row each. Throws Error for other
/// columns, options outside [0, K) and flags other than 0 and 1.
void Forward(Policy& policy, const EnvSpec& spec, const std::filesystem::path& input,
             const std::filesystem::path& output);

}  // namespace o2v
