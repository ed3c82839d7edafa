// After the first rollout and update nothing on the training path allocates: the C library's
// allocation functions are counted.

#include <gtest/gtest.h>

#include "algo/setup.h"

#if !defined(__SANITIZE_ADDRESS__)  // which replaces them itself
#include "allocation_counter.h"

namespace o2v {
namespace {

/// Allocations of more rollouts and updates after the first ones, at the method's own widths.
long Allocations(const EnvEntry& task, const std::string& method, Fidelity fidelity) {
  // Episodes of at most 30 steps: rollouts meet time limits and resets. The last minibatch is
  // smaller than the others.
  constexpr int kTimeLimit = 30;
  const RunConfig config = ConfigFor(task.id, method, fidelity, {"rollout=75", "epochs=1"});
  VecEnv env([&] { return task.make({}, kTimeLimit); }, config.workers, config.seed);
  env.Reset();
  const auto algorithm = MakeRunAlgorithm(config, env.Spec());
  std::vector<Episode> episodes;
  episodes.reserve(1000);
  const auto train = [&](int iterations) {
    for (int i = 0; i < iterations; ++i) {
      algorithm->Collect(env, episodes);
      algorithm->Update();
    }
  };
  train(1);
  const bool iopg = method == "iopg";
  if (iopg) {  // what first happens at the longest episode so far, and at a time limit
    Rng rng(1, "batch");
    const int S = env.Spec().S, K = algorithm->NumOptions();
    algorithm->Loss(0, RandomBatch(S, env.Spec().A, K, kTimeLimit, rng), nullptr);
    ZeroGrad(algorithm->Params());
    Mat q;
    algorithm->OptionValues(Mat::Zero(S, 1), {0}, q);
  }
  const long before = g_allocations;
  train(iopg ? 4 : 1);  // an iteration of IOPG is an episode
  const long after = g_allocations;
  EXPECT_GT(episodes.size(), 3u) << task.id;
  return after - before;
}

TEST(Allocations, AreCounted) {
  const long before = g_allocations;
  const Mat x = Mat::Ones(10, 10);
  const auto y = std::make_unique<std::vector<double>>(std::size_t(x.size()));
  EXPECT_EQ(g_allocations, before + 3) << y->size();
}

class TrainingAllocations : public testing::TestWithParam<std::string> {};

TEST_P(TrainingAllocations, DoNotHappenAfterTheFirstUpdate) {
  for (const EnvEntry& task : EnvRegistry()) {
    for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
      EXPECT_EQ(Allocations(task, GetParam(), fidelity), 0)
          << task.id << ", " << ToString(fidelity);
    }
  }
}

/// Allocations of a loss of IOPG on an episode of n steps.
long AllocationsOfEpisode(Algorithm& iopg, int n) {
  Rng rng(1, "batch");
  const Batch episode = RandomBatch(5, 3, iopg.NumOptions(), n, rng);
  const long before = g_allocations;
  iopg.Loss(0, episode, nullptr);
  return g_allocations - before;
}

TEST(TrainingAllocations, OfIopgGrowOnceWithALongerEpisode) {
  // The networks pass 64 steps at a time.
  EnvSpec spec = Sizes(5, 3);
  spec.time_limit = 100;
  const auto iopg = MakeRunAlgorithm(SmallConfig("iopg", Fidelity::kPaper), spec);
  EXPECT_GT(AllocationsOfEpisode(*iopg, 64), 10);
  const long least = AllocationsOfEpisode(*iopg, 64);
  EXPECT_EQ(AllocationsOfEpisode(*iopg, 30), least);
  EXPECT_GT(AllocationsOfEpisode(*iopg, 65), least + 10);
  EXPECT_EQ(AllocationsOfEpisode(*iopg, 100), least);
}

INSTANTIATE_TEST_SUITE_P(Methods, TrainingAllocations, testing::ValuesIn(MethodIds()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace o2v

#endif
