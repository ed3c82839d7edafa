#include "env/mujoco_env.h"

namespace o2v {
namespace {

/// Swimmer-v2: swim forward in a plane by bending two hinges.
/// obs (8): qpos[2:] [rad], qvel [m/s, rad/s]. action (2): control in [-1, 1].
/// reward: speed [m/s] - 1e-4 |a|^2. never ends. limit: 1000 steps of 0.04 s.
/// reset noise: qpos and qvel U(-0.1, 0.1).
/// Source: spec E.2.
class Swimmer final : public MujocoEnv {
 public:
  Swimmer(const EnvOptions& options, int time_limit)
      : MujocoEnv({"Swimmer-v2", "gym_swimmer", /*frame_skip=*/4, /*S=*/8}, options, time_limit) {}

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double> qvel) override {
    AddUniform(rng, 0.1, qpos);
    AddUniform(rng, 0.1, qvel);
  }

  double RewardQuantity() const override { return qpos()[0]; }

  Outcome RewardAndEnd(double before, double after, std::span<const double> a) const override {
    return {(after - before) / dt() - 1e-4 * SquaredNorm(a)};
  }

  void Observe(ObservationWriter& obs) const override {
    obs.Add(qpos().subspan(2));
    obs.Add(qvel());
  }
};

}  // namespace

std::unique_ptr<Env> MakeSwimmer(const EnvOptions& options, int time_limit) {
  return std::make_unique<Swimmer>(options, time_limit);
}

}  // namespace o2v
