// Same binary, config and seed: same bytes.

#include <gtest/gtest.h>

#include <sstream>
#include <tuple>

#include "real_run.h"

namespace o2v {
namespace {

using Case = std::tuple<const char*, const char*, const char*>;  // task, method, fidelity

class Determinism : public testing::TestWithParam<Case> {};

TEST_P(Determinism, TwoRunsWriteTheSameBytes) {
  const auto [task, algorithm, fidelity] = GetParam();
  RunConfig config = ShortRun(task, algorithm, fidelity, /*workers=*/2, /*iterations=*/6);
  config.eval_every = 3 * kRollout * 2;
  config.eval_episodes = 1;
  TestFolder dir;
  std::ostringstream progress;
  for (const char* name : {"a", "b"}) Train(config, dir / name, false, progress, false);
  for (const char* file :
       {"config.toml", "episodes.csv", "updates.csv", "evals.csv", "last.ckpt"}) {
    EXPECT_TRUE(ReadFile(dir / "a" / file) == ReadFile(dir / "b" / file)) << file;
  }
  config.seed += 1;
  Train(config, dir / "c", false, progress, false);
  EXPECT_FALSE(ReadFile(dir / "a" / "updates.csv") == ReadFile(dir / "c" / "updates.csv"));
}

std::string Name(const testing::TestParamInfo<Case>& info) {
  std::string name =
      Concat(std::get<0>(info.param), '_', std::get<1>(info.param), '_', std::get<2>(info.param));
  std::erase(name, '-');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Runs, Determinism,
                         testing::Combine(testing::Values("Reacher-v2", "Hopper-v2"),
                                          testing::Values("ppo", "option2vec"),
                                          testing::Values("paper", "released")),
                         Name);

}  // namespace
}  // namespace o2v
