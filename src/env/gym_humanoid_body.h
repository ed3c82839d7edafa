#pragma once
// What Humanoid-v2 and HumanoidStandup-v2 share: body, observation, costs, reset noise.

#include <algorithm>

#include "env/mujoco_env.h"

namespace o2v {

/// obs (376): qpos[2:] (22) [m, 1, rad], qvel (23) [m/s, rad/s], cinert (14 x 10), cvel (14 x 6),
/// qfrc_actuator (23), cfrc_ext (14 x 6), MuJoCo's units. action (17): control in [-0.4, 0.4].
/// reset noise: qpos and qvel U(-0.01, 0.01). limit: 1000 steps of 0.015 s.
/// Source: spec E.2.
class HumanoidBody : public MujocoEnv {
 protected:
  HumanoidBody(const std::string& id, const std::string& model, const EnvOptions& options,
               int time_limit)
      : MujocoEnv({id, model, /*frame_skip=*/5, /*S=*/376}, options, time_limit) {}

  /// 0.1 |a|^2 + min(0.5e-6 |cfrc_ext|^2, 10).
  double Cost(std::span<const double> a) const {
    return 0.1 * SquaredNorm(a) + std::min(0.5e-6 * SquaredNorm(cfrc_ext()), 10.0);
  }

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double> qvel) final {
    AddUniform(rng, 0.01, qpos);
    AddUniform(rng, 0.01, qvel);
  }

  void Observe(ObservationWriter& obs) const final {
    const auto bodies = static_cast<std::size_t>(model().nbody);
    obs.Add(qpos().subspan(2));
    obs.Add(qvel());
    obs.Add({data().cinert, 10 * bodies});
    obs.Add({data().cvel, 6 * bodies});
    obs.Add({data().qfrc_actuator, qvel().size()});
    obs.Add(cfrc_ext());
  }
};

}  // namespace o2v
