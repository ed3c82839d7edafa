#include <cmath>
#include <numbers>

#include "env/dm_env.h"

namespace o2v {
namespace {

/// dm-reacher-easy, dm-reacher-hard: bring the finger of a two-link arm into a target in the plane.
/// obs (6): qpos [rad], target - finger, x and y [m], qvel [rad/s]. action (2): control in [-1, 1].
/// reward: 1 while the finger touches the target, of radius 0.05 m (easy) or 0.015 m (hard), else
/// 0. limit: 1000 steps of 0.02 s.
/// initial state: shoulder U(-pi, pi), wrist uniform in its range; then the target at an angle
/// U(0, 2 pi), from the y axis, and a radius U(0.05, 0.2) [m].
/// Source: spec E.3.
class Reacher final : public DmEnv {
 public:
  Reacher(const char* id, double target_radius, int time_limit)
      : DmEnv({id, "dm_reacher", /*frame_skip=*/1, /*S=*/6}, time_limit) {
    model().geom_size[3 * target_] = target_radius;
  }

  /// x and y of the target [m].
  std::span<double> Target() override { return {model().geom_pos + 3 * target_, 2}; }

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double>) override {
    DrawUnlimitedHinges(rng, qpos);
    DrawLimitedJoints(rng, qpos);
    const double angle = rng.Uniform(0, 2 * std::numbers::pi), radius = rng.Uniform(0.05, 0.2);
    Target()[0] = radius * std::sin(angle);
    Target()[1] = radius * std::cos(angle);
  }

  // target - finger, coordinate i [m].
  double Gap(int i) const {
    return data().geom_xpos[3 * target_ + i] - data().geom_xpos[3 * finger_ + i];
  }

  double Reward(std::span<const double>) const override {
    const double reach = model().geom_size[3 * target_] + model().geom_size[3 * finger_];
    return Tolerance(std::hypot(Gap(0), Gap(1)), {0, reach});
  }

  void Observe(ObservationWriter& obs) const override {
    obs.Add(qpos());
    obs.Add(Gap(0));
    obs.Add(Gap(1));
    obs.Add(qvel());
  }

  int target_ = GeomId("target"), finger_ = GeomId("finger");
};

}  // namespace

std::unique_ptr<Env> MakeDmReacherEasy(const EnvOptions&, int time_limit) {
  return std::make_unique<Reacher>("dm-reacher-easy", 0.05, time_limit);
}

std::unique_ptr<Env> MakeDmReacherHard(const EnvOptions&, int time_limit) {
  return std::make_unique<Reacher>("dm-reacher-hard", 0.015, time_limit);
}

}  // namespace o2v
