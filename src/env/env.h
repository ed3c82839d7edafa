#pragma once
// What a task is to everybody else.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/rng.h"
#include "base/state.h"

namespace o2v {

/// Facts of a task.
struct EnvSpec {
  std::string id;                     // "Hopper-v2"
  int S = 0;                          // observation size
  int A = 0;                          // action size
  int time_limit = 0;                 // [environment steps]
  std::vector<double> a_low, a_high;  // (A) control range
};

/// What a step returns beside the observation. Both flags may be set.
struct StepResult {
  double reward = 0;
  bool terminated = false;  // the task ended: no value beyond
  bool truncated = false;   // the time limit was reached
};

/// Switches of the physics layer.
struct EnvOptions {
  bool contact_forces = false;  // fill cfrc_ext (mj_rnePostConstraint); spec E.1
};

/// One environment. Never resets by itself.
class Env {
 public:
  virtual ~Env() = default;
  virtual const EnvSpec& Spec() const = 0;

  /// Starts an episode with noise from `rng`; obs (S).
  virtual void Reset(Rng& rng, std::span<double> obs) = 0;
  /// Applies a (A), inside [a_low, a_high], for one environment step; obs (S) after it.
  /// Throws DivergedError on a simulator warning or a non-finite value.
  virtual StepResult Step(std::span<const double> a, std::span<double> obs) = 0;

  /// All state that the next step depends on, the steps of the running episode included.
  virtual void Serialize(StateVisitor& v, const std::string& prefix) = 0;
};

/// A registry line.
struct EnvEntry {
  std::string id;
  std::unique_ptr<Env> (*make)(const EnvOptions&, int time_limit);
  int time_limit;  // [environment steps]
};

/// All tasks, in the order of list.inc.
const std::vector<EnvEntry>& EnvRegistry();
/// Throws ConfigError for an unknown id; the message lists the nearest known ones.
std::unique_ptr<Env> MakeEnv(const std::string& id, const EnvOptions& options);

/// Version of the simulator, "2.2.2".
std::string PhysicsVersion();
/// The simulator's library that this process has loaded.
struct PhysicsLibrary {
  std::string file;    // absolute, without links
  std::string sha256;  // of the file
};
/// Hashed once. Throws Error when the file cannot be read.
const PhysicsLibrary& LoadedPhysics();

}  // namespace o2v
