#include <mujoco/mujoco.h>

#include "env/env.h"

namespace o2v {

std::string PhysicsVersion() { return mj_versionString(); }

}  // namespace o2v
