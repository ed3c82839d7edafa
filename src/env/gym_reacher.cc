#include <algorithm>
#include <cmath>

#include "env/mujoco_env.h"

namespace o2v {
namespace {

/// Reacher-v2: bring the fingertip of a two-link arm to a target in the plane.
/// obs (11): cos and sin of the two joints, target's x and y [m], joint velocities [rad/s],
/// fingertip - target [m]. action (2): control in [-1, 1].
/// reward: -|fingertip - target| before the step - |a|^2. never ends. limit: 50 steps of 0.02 s.
/// reset noise: qpos U(-0.1, 0.1), then the target uniform in the disc of radius 0.2 [m];
/// qvel U(-0.005, 0.005), 0 for the target.
/// Source: spec E.2.
class Reacher final : public MujocoEnv {
 public:
  Reacher(const EnvOptions& options, int time_limit)
      : MujocoEnv({"Reacher-v2", "gym_reacher", /*frame_skip=*/2, /*S=*/11}, options, time_limit) {}

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double> qvel) override {
    AddUniform(rng, 0.1, qpos);
    const std::span<double> goal = qpos.last(2);
    do {
      std::ranges::fill(goal, 0);
      AddUniform(rng, 0.2, goal);
    } while (SquaredNorm(goal) >= 0.2 * 0.2);
    AddUniform(rng, 0.005, qvel);
    std::ranges::fill(qvel.last(2), 0);
  }

  // fingertip - target, coordinate i [m].
  double Gap(int i) const { return data().xpos[3 * fingertip_ + i] - data().xpos[3 * target_ + i]; }

  double RewardQuantity() const override { return std::hypot(Gap(0), Gap(1), Gap(2)); }

  Outcome RewardAndEnd(double before, double, std::span<const double> a) const override {
    return {-before - SquaredNorm(a)};
  }

  void Observe(ObservationWriter& obs) const override {
    for (double angle : qpos().first(2)) obs.Add(std::cos(angle));
    for (double angle : qpos().first(2)) obs.Add(std::sin(angle));
    obs.Add(qpos().subspan(2));
    obs.Add(qvel().first(2));
    for (int i = 0; i < 3; ++i) obs.Add(Gap(i));
  }

  int fingertip_ = BodyId("fingertip"), target_ = BodyId("target");
};

}  // namespace

std::unique_ptr<Env> MakeReacher(const EnvOptions& options, int time_limit) {
  return std::make_unique<Reacher>(options, time_limit);
}

}  // namespace o2v
