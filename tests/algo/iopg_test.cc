// IOPG's bookkeeping of episodes (spec 4.5).

#include <gtest/gtest.h>

#include "algo/setup.h"

namespace o2v {
namespace {

TEST(Iopg, RefusesEpisodesLongerThanTwoTimeLimits) {
  // Made for a task of 4 steps, so with room for 8; the task's episodes have 9.
  VecEnv env = PointTask(/*workers=*/2, /*time_limit=*/9);
  EnvSpec spec = env.Spec();
  spec.time_limit = 4;
  const auto iopg = MakeRunAlgorithm(SmallConfig("iopg", Fidelity::kPaper), spec);
  std::vector<Episode> episodes;
  EXPECT_THROW(iopg->Collect(env, episodes), Error);
  EXPECT_EQ(env.TotalSteps(), 2 * 8);
}

}  // namespace
}  // namespace o2v
