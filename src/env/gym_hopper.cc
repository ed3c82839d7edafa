#include <algorithm>
#include <cmath>

#include "env/mujoco_env.h"

namespace o2v {
namespace {

/// Hopper-v2: hop forward on one leg in a plane.
/// obs (11): qpos[1:] [m, rad], qvel clipped to +-10 [m/s, rad/s]. action (3): control in [-1, 1].
/// reward: speed [m/s] + 1 - 1e-3 |a|^2. ends: unhealthy state. limit: 1000 steps of 0.008 s.
/// reset noise: qpos and qvel U(-0.005, 0.005).
/// Source: spec E.2.
class Hopper final : public MujocoEnv {
 public:
  Hopper(const EnvOptions& options, int time_limit)
      : MujocoEnv({"Hopper-v2", "gym_hopper", /*frame_skip=*/4, /*S=*/11}, options, time_limit) {}

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double> qvel) override {
    AddUniform(rng, 0.005, qpos);
    AddUniform(rng, 0.005, qvel);
  }

  double RewardQuantity() const override { return qpos()[0]; }

  Outcome RewardAndEnd(double before, double after, std::span<const double> a) const override {
    return {(after - before) / dt() + 1 - 1e-3 * SquaredNorm(a), !Healthy()};
  }

  // Upright, and nothing but the way run so far and the height is large.
  bool Healthy() const {
    const auto small = [](double x) { return std::abs(x) < 100; };
    return std::ranges::all_of(qpos().subspan(2), small) && std::ranges::all_of(qvel(), small) &&
           qpos()[1] > 0.7 && std::abs(qpos()[2]) < 0.2;
  }

  void Observe(ObservationWriter& obs) const override {
    obs.Add(qpos().subspan(1));
    obs.AddClipped(qvel(), 10);
  }
};

}  // namespace

std::unique_ptr<Env> MakeHopper(const EnvOptions& options, int time_limit) {
  return std::make_unique<Hopper>(options, time_limit);
}

}  // namespace o2v
