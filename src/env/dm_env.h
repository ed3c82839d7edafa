#pragma once
// What the tasks of DeepMind Control have in common.

#include <string>
#include <vector>

#include "env/mujoco_env.h"
#include "env/tolerance.h"

namespace o2v {

/// A task of DeepMind Control: it never terminates, its reward lies in [0, 1] and, like the
/// observation, is one of the state after the step alone, whose derived quantities are up to date.
/// Source: spec E.3.
class DmEnv : public MujocoEnv {
 public:
  void Serialize(StateVisitor& v, const std::string& prefix) final;

 protected:
  /// Contact forces are none of these tasks' quantities: never computed.
  DmEnv(const Facts& facts, int time_limit)
      : MujocoEnv(facts, EnvOptions{}, time_limit), q_(qpos().begin(), qpos().end()) {}

  /// Of the current state, reached with the controls a (A); in [0, 1].
  virtual double Reward(std::span<const double> a) const = 0;

  /// Places every limited joint uniformly in its range.
  void DrawLimitedJoints(Rng& rng, std::span<double> qpos) const;
  /// Turns every unlimited hinge to an angle in U(-pi, pi).
  void DrawUnlimitedHinges(Rng& rng, std::span<double> qpos) const;

  /// Entry of a body's rotation matrix; (2, 2) is 1 upright, -1 upside down.
  double Xmat(int body, int row, int column) const {
    return data().xmat[9 * body + 3 * row + column];
  }

 private:
  void ComputeDerived() final;
  void Simulate() final;
  Outcome RewardAndEnd(double, double, std::span<const double> a) const final {
    return {Reward(a)};
  }

  std::vector<double> q_;  // qpos that the current state's derived quantities were computed from
};

}  // namespace o2v
