#pragma once
// What the dimensions of the option embedding do to the actions (the paper's Figure 6).
//
// The paper perturbs the dimensions of an embedding and watches which action each of them moves
// most, its primary action; how, it does not say. Ours: the states are those that the policy
// visits, the embedding is that of the option executed there, and the answer is the signed mean
// over them of two quantities, the exact derivative of the mean action and its change by a step of
// the size `delta`.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "algo/algorithm.h"
#include "env/env.h"
#include "rollout/normalizer.h"
#include "run/checkpoint.h"
#include "run/config.h"

namespace o2v {

/// The usual `delta`, ours: the length of an embedding when training starts, shorter than the way
/// sqrt(2) from one option's to another's (spec 2.6, item 1).
constexpr double kDelta = 1;

/// Dimension d of the embedding by row. mu is the mean action as the policy gives it, not clipped.
struct Interpretation {
  MatD W_o;        // (D, K) the embedding matrix
  MatD effect;     // (D, A) mean of d mu_a / d o_hat_d [action / embedding]
  MatD perturbed;  // (D, A) mean of mu_a(s, o_hat + delta e_d) - mu_a(s, o_hat) [action]
  double delta;    // [embedding]
  Index states;    // visited
};

/// Means over the states of `episodes` whole episodes, which run as in Evaluate with sampled
/// actions: the same seed gives the same result. W_o is moved on the way and put back. Throws Error
/// for a method without an embedding and unless delta is positive and finite.
Interpretation Interpret(Policy& policy, const Normalizer& normalizer, Env& env, int episodes,
                         double delta, std::uint64_t seed);

/// A row a dimension: dimension, embedding_0.. (K), effect_0.. (A), perturbed_0.. (A), delta.
std::string InterpretationCsv(const Interpretation& interpretation);

/// How an interpretation was made, for the file beside its CSV: what the program was built from;
/// steps and configuration of the run, where its checkpoint says them; task, episodes and their
/// seed, states.
std::string InterpretationJson(const Interpretation& interpretation, const Metadata& checkpoint,
                               const std::string& task, int episodes, std::uint64_t seed);

/// Where the figure and the report look for the interpretation of a run on a task:
/// results/interpret/<fidelity>[-<switch>=<value>]/<task>/<method>/seed-NNN.csv
std::filesystem::path InterpretationPath(const RunConfig& config, const std::string& task);

/// The file beside the CSV of an interpretation, how it was made; nothing beside a device or a
/// pipe.
std::optional<std::filesystem::path> BesideInterpretation(const std::filesystem::path& csv);

/// Throws ConfigError unless both files can be written, and each that is there is one of an
/// interpretation, which is replaced.
void RequireInterpretationPlace(const std::filesystem::path& csv);

}  // namespace o2v
