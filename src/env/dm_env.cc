#include "env/dm_env.h"

#include <algorithm>
#include <numbers>

namespace o2v {

void DmEnv::DrawLimitedJoints(Rng& rng, std::span<double> qpos) const {
  const mjModel& m = model();
  for (int i = 0; i < m.njnt; ++i) {
    if (!m.jnt_limited[i]) continue;
    const double* range = m.jnt_range + 2 * i;
    qpos[std::size_t(m.jnt_qposadr[i])] = rng.Uniform(range[0], range[1]);
  }
}

void DmEnv::DrawUnlimitedHinges(Rng& rng, std::span<double> qpos) const {
  const mjModel& m = model();
  for (int i = 0; i < m.njnt; ++i) {
    if (m.jnt_limited[i] || m.jnt_type[i] != mjJNT_HINGE) continue;
    qpos[std::size_t(m.jnt_qposadr[i])] = rng.Uniform(-std::numbers::pi, std::numbers::pi);
  }
}

// Deriving normalises quaternions in qpos, and twice is not once in the last bit: what a resumed
// run derives its state from again is kept.
void DmEnv::ComputeDerived() {
  std::ranges::copy(qpos(), q_.begin());
  mj_forward(&model(), &data());
}

// Between two steps all that mj_step1 computes is there: mj_step2 is the rest of a physics step.
// RK4 cannot be cut in two.
void DmEnv::Simulate() {
  int left = frame_skip();
  if (model().opt.integrator != mjINT_RK4) {
    mj_step2(&model(), &data());
    --left;
  }
  for (; left > 0; --left) mj_step(&model(), &data());
  std::ranges::copy(qpos(), q_.begin());
  mj_step1(&model(), &data());
}

// A loaded state lacks what mj_step2 reads; when saving, mj_step1 finds again what is there. It
// does not touch qacc_warmstart.
void DmEnv::Serialize(StateVisitor& v, const std::string& prefix) {
  std::ranges::copy(q_, data().qpos);
  MujocoEnv::Serialize(v, prefix);
  std::ranges::copy(qpos(), q_.begin());
  mj_step1(&model(), &data());
}

}  // namespace o2v
