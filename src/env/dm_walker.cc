#include "env/dm_env.h"

namespace o2v {
namespace {

/// dm-walker-squat, dm-walker-stand: hold the torso upright and at a height, on two legs in a
/// plane; dm-walker-walk, dm-walker-backward: do so and walk.
/// obs (24): x and z of the x axis of each of the 7 bodies, the torso's height [m], qvel [m/s,
/// rad/s]. action (6): control in [-1, 1].
/// reward: three parts height (1 above 0.6 m in squat, above 1.2 m elsewhere) and one part
/// uprightness; when walking times a factor that rises from 1/6 at rest to 1 at 1 m/s in the task's
/// direction. limit: 1000 steps of 0.025 s.
/// initial state: limited joints uniform in their ranges, the torso turned by U(-pi, pi).
/// Source: spec E.3.
class Walker final : public DmEnv {
 public:
  Walker(const char* id, double height, double direction, int time_limit)
      : DmEnv({id, "dm_walker", /*frame_skip=*/10, /*S=*/24}, time_limit),
        height_(height),
        direction_(direction) {}

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double>) override {
    DrawLimitedJoints(rng, qpos);
    DrawUnlimitedHinges(rng, qpos);
  }

  double Height() const { return data().xpos[3 * torso_ + 2]; }

  double Reward(std::span<const double>) const override {
    const double standing = Tolerance(Height(), {height_, kInfinity}, height_ / 2);
    const double upright = (1 + Xmat(torso_, 2, 2)) / 2;
    const double stand = (3 * standing + upright) / 4;
    if (direction_ == 0) return stand;
    const double speed = direction_ * data().sensordata[velocity_];
    const double move = Tolerance(speed, {1, kInfinity}, 0.5, Sigmoid::kLinear, 0.5);
    return stand * (5 * move + 1) / 6;
  }

  void Observe(ObservationWriter& obs) const override {
    for (int body = 1; body < model().nbody; ++body) {
      obs.Add(Xmat(body, 0, 0));
      obs.Add(Xmat(body, 0, 2));
    }
    obs.Add(Height());
    obs.Add(qvel());
  }

  double height_;     // [m]
  double direction_;  // 1, -1, or 0: on the spot
  int torso_ = BodyId("torso");
  int velocity_ = model().sensor_adr[SensorId("torso_subtreelinvel")];
};

}  // namespace

std::unique_ptr<Env> MakeDmWalkerSquat(const EnvOptions&, int time_limit) {
  return std::make_unique<Walker>("dm-walker-squat", 0.6, 0, time_limit);
}

std::unique_ptr<Env> MakeDmWalkerStand(const EnvOptions&, int time_limit) {
  return std::make_unique<Walker>("dm-walker-stand", 1.2, 0, time_limit);
}

std::unique_ptr<Env> MakeDmWalkerWalk(const EnvOptions&, int time_limit) {
  return std::make_unique<Walker>("dm-walker-walk", 1.2, 1, time_limit);
}

std::unique_ptr<Env> MakeDmWalkerBackward(const EnvOptions&, int time_limit) {
  return std::make_unique<Walker>("dm-walker-backward", 1.2, -1, time_limit);
}

}  // namespace o2v
