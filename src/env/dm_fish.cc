#include "env/dm_env.h"

namespace o2v {
namespace {

/// dm-fish-upright, dm-fish-downleft: a fish turns its back up, or down.
/// obs (21): angles of the 7 joints [rad], up (z of the torso's z axis), qvel [m/s, rad/s]. action
/// (5): control in [-1, 1]. reward: Gaussian in the distance of up from 1, or from -1; 0.1 at 1.
/// limit: 1000 steps of 0.04 s.
/// initial state: orientation uniform, joints U(-0.2, 0.2).
/// Source: spec E.3.
class Fish final : public DmEnv {
 public:
  Fish(const char* id, double direction, int time_limit)
      : DmEnv({id, "dm_fish", /*frame_skip=*/10, /*S=*/21}, time_limit), direction_(direction) {}

 private:
  // qpos: the root's position (3) and quaternion (4), then the joints. The forward call that
  // follows normalises the quaternion, and of N^4 makes a uniform one.
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double>) override {
    for (double& q : qpos.subspan(3, 4)) q = rng.Normal();
    AddUniform(rng, 0.2, qpos.subspan(7));
  }

  double Up() const { return Xmat(torso_, 2, 2); }

  double Reward(std::span<const double>) const override {
    return Tolerance(direction_ * Up(), {1, 1}, 1);
  }

  void Observe(ObservationWriter& obs) const override {
    obs.Add(qpos().subspan(7));
    obs.Add(Up());
    obs.Add(qvel());
  }

  double direction_;  // 1 or -1
  int torso_ = BodyId("torso");
};

}  // namespace

std::unique_ptr<Env> MakeDmFishUpright(const EnvOptions&, int time_limit) {
  return std::make_unique<Fish>("dm-fish-upright", 1, time_limit);
}

std::unique_ptr<Env> MakeDmFishDownleft(const EnvOptions&, int time_limit) {
  return std::make_unique<Fish>("dm-fish-downleft", -1, time_limit);
}

}  // namespace o2v
