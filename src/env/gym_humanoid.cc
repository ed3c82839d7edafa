#include "env/gym_humanoid_body.h"

namespace o2v {
namespace {

/// Humanoid-v2: walk forward on two legs. Observation, action, noise: HumanoidBody.
/// reward: 1.25 speed of the centre of mass [m/s] + 5 - cost. ends: torso height outside [1, 2].
/// Source: spec E.2.
class Humanoid final : public HumanoidBody {
 public:
  Humanoid(const EnvOptions& options, int time_limit)
      : HumanoidBody("Humanoid-v2", "gym_humanoid", options, time_limit) {}

 private:
  // x of the centre of mass [m].
  double RewardQuantity() const override {
    double mass = 0, moment = 0;
    for (int body = 0; body < model().nbody; ++body) {
      mass += model().body_mass[body];
      moment += model().body_mass[body] * data().xipos[3 * body];
    }
    return moment / mass;
  }

  Outcome RewardAndEnd(double before, double after, std::span<const double> a) const override {
    const double height = qpos()[2];
    return {1.25 * (after - before) / dt() + 5 - Cost(a), height < 1.0 || height > 2.0};
  }
};

}  // namespace

std::unique_ptr<Env> MakeHumanoid(const EnvOptions& options, int time_limit) {
  return std::make_unique<Humanoid>(options, time_limit);
}

}  // namespace o2v
