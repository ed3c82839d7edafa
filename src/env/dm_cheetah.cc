#include "env/dm_env.h"

namespace o2v {
namespace {

/// dm-cheetah-run, dm-cheetah-backward: run on two legs in a plane.
/// obs (17): qpos[1:] [m, rad], qvel [m/s, rad/s]. action (6): control in [-1, 1].
/// reward: the centre of mass's speed in the task's direction, in tenths of m/s, clipped to [0, 1].
/// limit: 1000 steps of 0.01 s.
/// initial state: what 200 physics steps without control make of limited joints drawn uniformly in
/// their ranges.
/// Source: spec E.3.
class Cheetah final : public DmEnv {
 public:
  Cheetah(const char* id, double direction, int time_limit)
      : DmEnv({id, "dm_cheetah", /*frame_skip=*/1, /*S=*/17}, time_limit), direction_(direction) {}

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double>) override {
    DrawLimitedJoints(rng, qpos);
    for (int i = 0; i < 200; ++i) mj_step(&model(), &data());
  }

  double Reward(std::span<const double>) const override {
    const double speed = direction_ * data().sensordata[velocity_];
    return Tolerance(speed, {10, kInfinity}, 10, Sigmoid::kLinear, 0);
  }

  void Observe(ObservationWriter& obs) const override {
    obs.Add(qpos().subspan(1));
    obs.Add(qvel());
  }

  double direction_;  // 1 or -1
  int velocity_ = model().sensor_adr[SensorId("torso_subtreelinvel")];
};

}  // namespace

std::unique_ptr<Env> MakeDmCheetahRun(const EnvOptions&, int time_limit) {
  return std::make_unique<Cheetah>("dm-cheetah-run", 1, time_limit);
}

std::unique_ptr<Env> MakeDmCheetahBackward(const EnvOptions&, int time_limit) {
  return std::make_unique<Cheetah>("dm-cheetah-backward", -1, time_limit);
}

}  // namespace o2v
