#include <algorithm>

#include "env/mujoco_env.h"

namespace o2v {
namespace {

/// Ant-v2: run forward on four legs.
/// obs (111): qpos[2:] [m, 1, rad], qvel [m/s, rad/s], cfrc_ext of 14 bodies clipped to +-1 [N m,
/// N]. action (8): control in [-1, 1]. reward: speed of the torso [m/s] - 0.5 |a|^2 - 0.5e-3
/// |clip(cfrc_ext)|^2 + 1. ends: torso height outside [0.2, 1]. limit: 1000 steps of 0.05 s. reset
/// noise: qpos U(-0.1, 0.1), qvel 0.1 N. Source: spec E.2.
class Ant final : public MujocoEnv {
 public:
  Ant(const EnvOptions& options, int time_limit)
      : MujocoEnv({"Ant-v2", "gym_ant", /*frame_skip=*/5, /*S=*/111}, options, time_limit) {}

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double> qvel) override {
    AddUniform(rng, 0.1, qpos);
    AddNormal(rng, 0.1, qvel);
  }

  double RewardQuantity() const override { return data().xpos[3 * torso_]; }

  Outcome RewardAndEnd(double before, double after, std::span<const double> a) const override {
    double contact = 0;
    for (double force : cfrc_ext()) {
      const double clipped = std::clamp(force, -1.0, 1.0);
      contact += clipped * clipped;
    }
    const double height = qpos()[2];
    return {(after - before) / dt() - 0.5 * SquaredNorm(a) - 0.5e-3 * contact + 1,
            height < 0.2 || height > 1.0};
  }

  void Observe(ObservationWriter& obs) const override {
    obs.Add(qpos().subspan(2));
    obs.Add(qvel());
    obs.AddClipped(cfrc_ext(), 1);
  }

  int torso_ = BodyId("torso");
};

}  // namespace

std::unique_ptr<Env> MakeAnt(const EnvOptions& options, int time_limit) {
  return std::make_unique<Ant>(options, time_limit);
}

}  // namespace o2v
