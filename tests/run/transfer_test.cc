// A run over two tasks: when the task changes, and that it can be interrupted on either side.

#include <gtest/gtest.h>

#include <sstream>

#include "fake_run.h"
#include "run/checkpoint.h"
#include "run/metrics.h"

namespace o2v {
namespace {

/// The fake task with 100 more reward a step on the second task; counts the steps made on each.
class NumberedEnv final : public Env {
 public:
  NumberedEnv(int task, std::vector<int>& steps) : task_(task), steps_(steps) {}

  const EnvSpec& Spec() const override { return env_.Spec(); }
  void Reset(Rng& rng, std::span<double> obs) override { env_.Reset(rng, obs); }
  StepResult Step(std::span<const double> a, std::span<double> obs) override {
    ++steps_[std::size_t(task_)];
    StepResult result = env_.Step(a, obs);
    result.reward += 100 * task_;
    return result;
  }
  /// A state of its own on each task: it cannot be loaded on the other one.
  void Serialize(StateVisitor& v, const std::string& prefix) override {
    env_.Serialize(v, prefix + "task" + std::to_string(task_) + ".");
  }

 private:
  FakeEnv env_;
  const int task_;
  std::vector<int>& steps_;
};

struct ChangedAlgorithm final : public FakeAlgorithm {
  ChangedAlgorithm(const EnvSpec& spec, std::uint64_t seed, int& changes)
      : FakeAlgorithm(spec, seed), changes_(changes) {}
  void ChangeTask() override { ++changes_; }
  int& changes_;
};

class Transfer : public testing::Test {
 protected:
  RunStatus Run(const std::string& name, bool resume = false, const RunHooks& hooks = {}) {
    return Train(config_, parts_, dir_ / name, resume, progress_, /*terminal=*/false, hooks);
  }

  TestFolder dir_;
  RunConfig config_ = FakeConfig();  // 200 steps, 10 an iteration
  std::vector<int> steps_ = {0, 0};
  int changes_ = 0;
  RunParts parts_ = {[this](int task) { return std::make_unique<NumberedEnv>(task, steps_); },
                     [this](const EnvSpec& spec) {
                       return std::make_unique<ChangedAlgorithm>(spec, config_.seed, changes_);
                     },
                     2};
  std::ostringstream progress_;
};

TEST_F(Transfer, TheTaskChangesAfterTheFirstUpdateBeyondHalfOfTheSteps) {
  config_.eval_every = 0;
  Run("run");
  // 100 is not beyond 100: the change comes at 110.
  EXPECT_EQ(steps_, (std::vector<int>{110, 90}));
  EXPECT_EQ(changes_, 1);
}

TEST_F(Transfer, TheLogGoesOnAndTheOldTasksEpisodesAreForgotten) {
  Run("run");
  int on_second = 0;
  for (const auto& [step, ret] : ReadEpisodes(dir_ / "run" / "episodes.csv")) {
    EXPECT_EQ(ret > 0, step >= 110) << step;  // -x^2 a step before, about 100 after
    on_second += step >= 110;
  }
  EXPECT_GT(on_second, 10);
}

TEST_F(Transfer, KeepsThePolicyThatTheFirstTaskLeaves) {
  Run("pair");
  parts_.tasks = 1;
  config_.steps = 110;
  Run("first alone");
  const std::filesystem::path kept = dir_ / "pair" / "Fake-v0.safetensors";
  EXPECT_EQ(ReadMetadata(kept).at("total_steps"), "110");
  const EnvSpec spec = FakeEnv().Spec();
  FakeAlgorithm policy(spec, 0), expected(spec, 1);
  Normalizer normalizer(spec.S), statistics(spec.S);
  LoadPolicy(kept, policy, normalizer);
  LoadPolicy(dir_ / "first alone" / "last.ckpt", expected, statistics);
  for (std::size_t i = 0; i < policy.Params().size(); ++i) {
    EXPECT_EQ(policy.Params()[i]->value, expected.Params()[i]->value);
  }
  EXPECT_EQ(normalizer.mean(), statistics.mean());
  EXPECT_EQ(normalizer.var(), statistics.var());
}

TEST_F(Transfer, GoesOnFromAnInterruptionOnEitherSide) {
  struct Interrupt {};
  config_.checkpoint_every = 55;  // after 60, 110 (the change itself), 170 and 200 steps
  Run("whole");
  for (int n = 1; n <= 4; ++n) {
    const std::string name = std::to_string(n);
    int count = 0;
    RunHooks hooks;
    hooks.before_rename = [&] {
      if (++count == n) throw Interrupt();
    };
    EXPECT_THROW(Run(name, false, hooks), Interrupt);
    EXPECT_EQ(Run(name, true), RunStatus::kDone);
    for (const std::string& file : kPromised) {
      EXPECT_TRUE(ReadFile(dir_ / name / file) == ReadFile(dir_ / "whole" / file)) << n << file;
    }
  }
}

}  // namespace
}  // namespace o2v
