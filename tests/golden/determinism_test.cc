// Same binary, config and seed: same bytes.

#include <gtest/gtest.h>

#include <sstream>

#include "real_run.h"

namespace o2v {
namespace {

class Determinism : public testing::TestWithParam<RunCase> {};

TEST_P(Determinism, TwoRunsWriteTheSameBytes) {
  RunConfig config = ShortRun(GetParam(), /*iterations=*/6);
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

std::vector<RunCase> Cases() {
  std::vector<RunCase> cases;
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
      cases.push_back({"Hopper-v2", method.id, fidelity, /*workers=*/2});
      const bool more = method.id == "ppo" || method.id == "option2vec";
      if (more) cases.push_back({"Reacher-v2", method.id, fidelity, /*workers=*/2});
    }
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Runs, Determinism, testing::ValuesIn(Cases()),
                         [](const auto& info) { return info.param.Name(); });

}  // namespace
}  // namespace o2v
