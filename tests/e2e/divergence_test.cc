// A run that diverges is a result, whatever diverges first.

#include <gtest/gtest.h>

#include <sstream>

#include "base/files.h"
#include "run/checkpoint.h"
#include "run/metrics.h"
#include "run/record.h"
#include "run/trainer.h"
#include "test_folder.h"

namespace o2v {
namespace {

/// (method, fidelity)
class DivergingRun : public testing::TestWithParam<std::tuple<std::string, std::string>> {};

TEST_P(DivergingRun, LeavesARecordAndNothingThatIsNotFinite) {
  const auto& [method, fidelity] = GetParam();
  RunRequest request;
  request.task = "InvertedPendulum-v2";
  request.algorithm = method;
  request.fidelity = fidelity;
  request.steps = 2000;
  request.set = {"learning_rate=1e30", "checkpoint_every=1"};
  RunConfig config = ResolveRun(request);
  if (config.hyper.Has("rollout")) config.hyper.Set("rollout", 64, "test");
  const TestFolder folder;
  std::ostringstream progress;
  EXPECT_THROW(Train(config, folder / "run", /*resume=*/false, progress, /*terminal=*/false),
               DivergedError);
  EXPECT_EQ(ReadManifest(folder / "run")->status, RunStatus::kDiverged);
  EXPECT_EQ(ReadRecordHead(folder / "run.json").status, RunStatus::kDiverged);
  EXPECT_TRUE(std::filesystem::exists(folder / "run.csv"));
  // Readers of these files refuse numbers that are not finite.
  ReadUpdates(folder / "run" / "updates.csv");
  EXPECT_FALSE(ReadEpisodes(folder / "run" / "episodes.csv").empty());
  // OC and IOPG make a step an update: their first one ends finite, and has a checkpoint.
  const std::filesystem::path checkpoint = folder / "run" / "last.ckpt";
  ASSERT_EQ(std::filesystem::exists(checkpoint), method == "oc" || method == "iopg");
  if (!std::filesystem::exists(checkpoint)) return;
  EXPECT_LT(TotalSteps(ReadMetadata(checkpoint)).value(), ReadManifest(folder / "run")->steps);
  const RunParts parts = PartsOf(config);
  const EnvSpec spec = parts.make_env(0)->Spec();
  Normalizer normalizer(spec.S);
  LoadPolicy(checkpoint, *parts.make_algorithm(spec), normalizer);
}

std::vector<std::string> Methods() {
  std::vector<std::string> ids;
  for (const AlgorithmEntry& entry : AlgorithmRegistry()) ids.push_back(entry.id);
  return ids;
}

INSTANTIATE_TEST_SUITE_P(AllMethods, DivergingRun,
                         testing::Combine(testing::ValuesIn(Methods()),
                                          testing::Values("paper", "released")),
                         [](const auto& info) {
                           return std::get<0>(info.param) + "_" + std::get<1>(info.param);
                         });

}  // namespace
}  // namespace o2v
