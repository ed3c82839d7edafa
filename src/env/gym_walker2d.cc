#include "env/mujoco_env.h"

namespace o2v {
namespace {

/// Walker2d-v2: walk forward on two legs in a plane.
/// obs (17): qpos[1:] [m, rad], qvel clipped to +-10 [m/s, rad/s]. action (6): control in [-1, 1].
/// reward: speed [m/s] + 1 - 1e-3 |a|^2. ends: torso low, high or tilted. limit: 1000 steps of
/// 0.008 s. reset noise: qpos and qvel U(-0.005, 0.005). Source: spec E.2.
class Walker2d final : public MujocoEnv {
 public:
  Walker2d(const EnvOptions& options, int time_limit)
      : MujocoEnv({"Walker2d-v2", "gym_walker2d", /*frame_skip=*/4, /*S=*/17}, options,
                  time_limit) {}

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double> qvel) override {
    AddUniform(rng, 0.005, qpos);
    AddUniform(rng, 0.005, qvel);
  }

  double RewardQuantity() const override { return qpos()[0]; }

  Outcome RewardAndEnd(double before, double after, std::span<const double> a) const override {
    const double height = qpos()[1], tilt = qpos()[2];
    const bool healthy = 0.8 < height && height < 2.0 && -1 < tilt && tilt < 1;
    return {(after - before) / dt() + 1 - 1e-3 * SquaredNorm(a), !healthy};
  }

  void Observe(ObservationWriter& obs) const override {
    obs.Add(qpos().subspan(1));
    obs.AddClipped(qvel(), 10);
  }
};

}  // namespace

std::unique_ptr<Env> MakeWalker2d(const EnvOptions& options, int time_limit) {
  return std::make_unique<Walker2d>(options, time_limit);
}

}  // namespace o2v
