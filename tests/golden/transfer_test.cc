// Runs over a pair of DeepMind Control tasks: every method on every pair, interrupted on either
// side of the change, and what stays constant across it.

#include <gtest/gtest.h>

#include <sstream>

#include "env/pairs.h"
#include "real_run.h"
#include "run/checkpoint.h"

namespace o2v {
namespace {

struct Interrupt {};

/// A run with checkpoints after iterations 2, 4, 6 and 8, whose task changes after the fifth, in
/// the middle of episodes. IOPG's iterations are whole episodes: the second of three ends the task.
RunConfig PairRun(const RunCase& c) {
  RunConfig config = ShortRun(c, /*iterations=*/8);
  if (c.algorithm == "iopg") {
    config.steps = 3 * 1000 * c.workers;  // the time limit
    config.checkpoint_every = 1000 * c.workers;
  }
  return config;
}

/// Trains until the checkpoint number `n` (from 1) is about to be put in place.
void TrainUntil(const RunConfig& config, const std::filesystem::path& dir, int n) {
  std::ostringstream progress;
  RunHooks hooks;
  hooks.before_rename = [&n] {
    if (--n == 0) throw Interrupt();
  };
  Train(config, dir, /*resume=*/false, progress, false, hooks);
}

class TransferRun : public testing::TestWithParam<RunCase> {};

TEST_P(TransferRun, GoesOnFromEitherSideOfTheChange) {
  const RunConfig config = PairRun(GetParam());
  TestFolder dir;
  std::ostringstream progress;
  Train(config, dir / "whole", false, progress, false);
  // Goes on from nothing, from iterations 2 and 4 before the change and 6 after it; IOPG from
  // nothing, and right before and after it.
  const int checkpoints = GetParam().algorithm == "iopg" ? 3 : 4;
  for (int lost = 1; lost <= checkpoints; ++lost) {
    const std::string name = std::to_string(lost);
    try {
      TrainUntil(config, dir / name, lost);
      FAIL() << "no checkpoint " << lost;
    } catch (const Interrupt&) {
    }
    Train(config, dir / name, /*resume=*/true, progress, false);
    for (const char* file : {"config.toml", "episodes.csv", "updates.csv", "last.ckpt"}) {
      EXPECT_TRUE(ReadFile(dir / name / file) == ReadFile(dir / "whole" / file)) << lost << file;
    }
  }
}

std::vector<RunCase> Cases() {
  std::vector<RunCase> cases;
  for (const TaskPair& pair : PairRegistry()) {
    for (const AlgorithmEntry& method : AlgorithmRegistry()) {
      // Its 1000 steps an iteration take long where physics is slow.
      if (method.id == "iopg" && pair.name != "CartPole" && pair.name != "Reacher") continue;
      for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
        cases.push_back({pair.name, method.id, fidelity, /*workers=*/2});
      }
    }
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Pairs, TransferRun, testing::ValuesIn(Cases()),
                         [](const auto& info) { return info.param.Name(); });

/// W_o in the checkpoint of a run of `config` that is stopped after `steps`, or runs to its end.
Mat EmbeddingAfter(const RunConfig& config, const std::filesystem::path& dir, std::int64_t steps) {
  std::ostringstream progress;
  RunHooks hooks;
  int iterations = 0;
  hooks.stop = [&] { return ++iterations * kRollout * config.workers == steps; };
  Train(config, dir, /*resume=*/true, progress, false, hooks);
  const EnvSpec spec = MakeEnv(SplitTasks(config.task)[0], {})->Spec();
  const auto algorithm = MakeRunAlgorithm(config, spec);
  Normalizer normalizer(spec.S);
  LoadPolicy(dir / "last.ckpt", *algorithm, normalizer);
  return FindParam(*algorithm, "embed.W_o").value;
}

TEST(TransferRun, OfOption2VecKeepsTheEmbeddingByteForByteOnTheSecondTask) {
  for (const char* freeze : {"paper", "none"}) {
    RunConfig config = PairRun({"Cheetah", "option2vec", Fidelity::kPaper, 2});
    config.switches.o2v_freeze = freeze == std::string("paper") ? Freeze::kPaper : Freeze::kNone;
    TestFolder dir;
    const Mat start = EmbeddingAfter(config, dir / "run", 16);
    const Mat change = EmbeddingAfter(config, dir / "run", 64);
    const Mat end = EmbeddingAfter(config, dir / "run", -1);
    EXPECT_FALSE(start == change);
    EXPECT_EQ(change == end, freeze == std::string("paper"));
  }
}

TEST(TransferRun, OfTasksOfDifferentSizesIsRefused) {
  try {
    PartsOf(PairRun({"dm-cheetah-run,dm-walker-walk", "ppo", Fidelity::kPaper, 1}));
    FAIL() << "accepted";
  } catch (const ConfigError& e) {
    EXPECT_STREQ(e.what(),
                 "tasks 'dm-cheetah-run,dm-walker-walk': dm-cheetah-run has 17 observations and 6 "
                 "actions, dm-walker-walk has 24 and 6");
  }
}

}  // namespace
}  // namespace o2v
