#include <cmath>

#include "env/mujoco_env.h"

namespace o2v {
namespace {

/// InvertedDoublePendulum-v2: keep two poles in a row upright on a cart.
/// obs (11): qpos[0] [m], sin and cos of the two angles, qvel clipped to +-10 [m/s, rad/s],
/// qfrc_constraint clipped to +-10 [N, N m]. action (1): control in [-1, 1].
/// reward: 10 - (0.01 x^2 + (z - 2)^2) - (1e-3 w1^2 + 5e-3 w2^2); x, z of the tip [m], w the poles'
/// angular velocities [rad/s]. ends: z <= 1. limit: 1000 steps of 0.05 s.
/// reset noise: qpos U(-0.1, 0.1), qvel 0.1 N.
/// Source: spec E.2.
class InvertedDoublePendulum final : public MujocoEnv {
 public:
  InvertedDoublePendulum(const EnvOptions& options, int time_limit)
      : MujocoEnv({"InvertedDoublePendulum-v2", "gym_inverted_double_pendulum", /*frame_skip=*/5,
                   /*S=*/11},
                  options, time_limit) {}

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double> qvel) override {
    AddUniform(rng, 0.1, qpos);
    AddNormal(rng, 0.1, qvel);
  }

  Outcome RewardAndEnd(double, double, std::span<const double>) const override {
    const double x = data().site_xpos[3 * tip_], z = data().site_xpos[3 * tip_ + 2];
    const double w1 = qvel()[1], w2 = qvel()[2];
    const double off_target = 0.01 * x * x + (z - 2) * (z - 2);
    const double spin = 1e-3 * w1 * w1 + 5e-3 * w2 * w2;
    return {10 - off_target - spin, z <= 1};
  }

  void Observe(ObservationWriter& obs) const override {
    obs.Add(qpos()[0]);
    for (double angle : qpos().subspan(1)) obs.Add(std::sin(angle));
    for (double angle : qpos().subspan(1)) obs.Add(std::cos(angle));
    obs.AddClipped(qvel(), 10);
    obs.AddClipped({data().qfrc_constraint, qvel().size()}, 10);
  }

  int tip_ = SiteId("tip");
};

}  // namespace

std::unique_ptr<Env> MakeInvertedDoublePendulum(const EnvOptions& options, int time_limit) {
  return std::make_unique<InvertedDoublePendulum>(options, time_limit);
}

}  // namespace o2v
