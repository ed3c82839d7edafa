#pragma once
// N workers of one task behind one normaliser.

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "base/rng.h"
#include "env/env.h"
#include "rollout/normalizer.h"

namespace o2v {

/// One finished episode: a row of episodes.csv.
struct Episode {
  std::int64_t step;  // environment steps of all workers before this one, plus the worker; spec 1.1
  int worker;
  double ret;  // undiscounted sum of raw rewards
  int length;  // [environment steps]
  bool terminated, truncated;
};

/// What a step of all workers returned. Sized by VecEnv.
struct Transition {
  VecD r;                                   // (N) raw rewards
  std::vector<char> terminated, truncated;  // (N)
  /// (S, N) the last observation of an episode that was truncated and not terminated, normalised
  /// with the current statistics without updating them; other columns are stale.
  Mat s_last;

  bool Done(std::size_t i) const { return terminated[i] || truncated[i]; }
  /// The episode ended by its time limit only.
  bool TimeLimit(std::size_t i) const { return truncated[i] && !terminated[i]; }
};

/// Steps N environments together; resets a worker whose episode ended and normalises what it sees.
class VecEnv {
 public:
  using Factory = std::function<std::unique_ptr<Env>()>;

  /// Worker i draws its resets from the stream "worker<i>" of `seed`.
  VecEnv(const Factory& make, int workers, std::uint64_t seed);

  const EnvSpec& Spec() const { return envs_[0]->Spec(); }
  int Workers() const { return static_cast<int>(envs_.size()); }
  std::int64_t TotalSteps() const { return total_steps_; }

  /// Starts an episode in every worker and takes the observations into the normaliser.
  void Reset();
  /// Puts the workers on another task of the same sizes and resets it; the running episodes are
  /// forgotten, normaliser, streams and step counter go on. Unless `set_init`, EpisodeStarts()
  /// stays as it was: the new task looks like a continuation of the old episode. Source: spec 6.
  void ChangeTask(const Factory& make, bool set_init);
  /// Puts the workers on another task without touching anything else, for Serialize to fill in.
  void ReplaceEnvs(const Factory& make);
  /// Steps every worker with a (A, N), clipped here to the control range. Appends ended episodes.
  /// Throws DivergedError as Env::Step, and when a return overflows.
  void Step(const Mat& a, Transition& out, std::vector<Episode>& episodes);

  /// (S, N) normalised states; at an episode's end the reset observation. Spec 1.1.
  const Mat& States() const { return s_; }
  /// (N) 1 where States() is the first of an episode.
  const std::vector<char>& EpisodeStarts() const { return init_; }
  const Normalizer& normalizer() const { return normalizer_; }

  void Serialize(StateVisitor& v);

 private:
  void Observe();  // raw_ into the normaliser, then into s_

  std::vector<std::unique_ptr<Env>> envs_;
  std::vector<Rng> rngs_;
  Normalizer normalizer_;
  std::int64_t total_steps_ = 0;
  MatD raw_, last_;  // (S, N) observations; those that a reset replaced
  Mat s_;
  std::vector<char> init_;
  VecD returns_;  // (N) of the running episodes
  std::vector<int> lengths_;
  std::vector<double> a_env_;  // (A) clipped action
};

}  // namespace o2v
