// Every experiment file of paper_configs/ runs.

#include <gtest/gtest.h>

#include <cmath>

#include "report/jobs.h"
#include "run/trainer.h"
#include "test_folder.h"

namespace o2v {
namespace {

class PaperConfigs : public testing::TestWithParam<const char*> {};

TEST_P(PaperConfigs, EveryRunOfTheFirstSeedMakesTwoUpdates) {
  const TestFolder folder;
  JobQuery query;
  query.configs = {GetParam()};
  query.results = folder.path();
  query.seeds = {0};
  for (Job& job : ListJobs(query)) {
    // Steps a worker: two rollouts take no time. IOPG has episodes instead.
    const bool rollouts = job.config.hyper.Has("rollout");
    if (rollouts) job.config.hyper.Set("rollout", 32, "test");
    const RunParts parts = PartsOf(job.config);
    VecEnv env([&] { return parts.make_env(0); }, job.config.workers, job.config.seed);
    auto algorithm = parts.make_algorithm(env.Spec());
    env.Reset();
    std::vector<Episode> episodes;
    for (int update = 0; update < 2; ++update) {
      algorithm->Collect(env, episodes);
      for (const SumAndCount& x : algorithm->Update()) {
        EXPECT_TRUE(std::isfinite(x.Value())) << job.command;
      }
    }
    if (!rollouts) continue;
    EXPECT_EQ(env.TotalSteps(), 2 * 32 * job.config.workers) << job.command;
  }
}

INSTANTIATE_TEST_SUITE_P(Embedded, PaperConfigs,
                         testing::Values("quick", "ci", "single_task", "transfer", "ablation"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace o2v
