#include "env/gym_humanoid_body.h"

namespace o2v {
namespace {

/// HumanoidStandup-v2: get up from lying on the back. Observation, action, noise: HumanoidBody.
/// reward: torso height [m] / physics timestep [s] + 1 - cost. never ends.
/// The divisor is not dt: a known oddity of the reference.
/// Source: spec E.2.
class HumanoidStandup final : public HumanoidBody {
 public:
  HumanoidStandup(const EnvOptions& options, int time_limit)
      : HumanoidBody("HumanoidStandup-v2", "gym_humanoidstandup", options, time_limit) {}

 private:
  Outcome RewardAndEnd(double, double, std::span<const double> a) const override {
    return {qpos()[2] / model().opt.timestep + 1 - Cost(a)};
  }
};

}  // namespace

std::unique_ptr<Env> MakeHumanoidStandup(const EnvOptions& options, int time_limit) {
  return std::make_unique<HumanoidStandup>(options, time_limit);
}

}  // namespace o2v
