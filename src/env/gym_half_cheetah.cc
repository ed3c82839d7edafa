#include "env/mujoco_env.h"

namespace o2v {
namespace {

/// HalfCheetah-v2: run forward on two legs in a plane.
/// obs (17): qpos[1:] [m, rad], qvel [m/s, rad/s]. action (6): control in [-1, 1].
/// reward: speed [m/s] - 0.1 |a|^2. never ends. limit: 1000 steps of 0.05 s.
/// reset noise: qpos U(-0.1, 0.1), qvel 0.1 N.
/// Source: spec E.2.
class HalfCheetah final : public MujocoEnv {
 public:
  HalfCheetah(const EnvOptions& options, int time_limit)
      : MujocoEnv({"HalfCheetah-v2", "gym_half_cheetah", /*frame_skip=*/5, /*S=*/17}, options,
                  time_limit) {}

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double> qvel) override {
    AddUniform(rng, 0.1, qpos);
    AddNormal(rng, 0.1, qvel);
  }

  double RewardQuantity() const override { return qpos()[0]; }

  Outcome RewardAndEnd(double before, double after, std::span<const double> a) const override {
    return {(after - before) / dt() - 0.1 * SquaredNorm(a)};
  }

  void Observe(ObservationWriter& obs) const override {
    obs.Add(qpos().subspan(1));
    obs.Add(qvel());
  }
};

}  // namespace

std::unique_ptr<Env> MakeHalfCheetah(const EnvOptions& options, int time_limit) {
  return std::make_unique<HalfCheetah>(options, time_limit);
}

}  // namespace o2v
