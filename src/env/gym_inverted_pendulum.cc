#include <cmath>

#include "env/mujoco_env.h"

namespace o2v {
namespace {

/// InvertedPendulum-v2: keep a pole upright on a cart.
/// obs (4): qpos [m, rad], qvel [m/s, rad/s]. action (1): control in [-3, 3].
/// reward: 1. ends: pole tilted by more than 0.2 rad. limit: 1000 steps of 0.04 s.
/// reset noise: qpos and qvel U(-0.01, 0.01).
/// Source: spec E.2.
class InvertedPendulum final : public MujocoEnv {
 public:
  InvertedPendulum(const EnvOptions& options, int time_limit)
      : MujocoEnv({"InvertedPendulum-v2", "gym_inverted_pendulum", /*frame_skip=*/2, /*S=*/4},
                  options, time_limit) {}

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double> qvel) override {
    AddUniform(rng, 0.01, qpos);
    AddUniform(rng, 0.01, qvel);
  }

  Outcome RewardAndEnd(double, double, std::span<const double>) const override {
    return {1, std::abs(qpos()[1]) > 0.2};
  }

  void Observe(ObservationWriter& obs) const override {
    obs.Add(qpos());
    obs.Add(qvel());
  }
};

}  // namespace

std::unique_ptr<Env> MakeInvertedPendulum(const EnvOptions& options, int time_limit) {
  return std::make_unique<InvertedPendulum>(options, time_limit);
}

}  // namespace o2v
