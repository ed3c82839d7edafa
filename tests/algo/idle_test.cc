// What happens to tensors that a minibatch does not use (spec 1.4, 2.7).

#include <gtest/gtest.h>

#include "algo/setup.h"

namespace o2v {
namespace {

enum Stage { kHigh = 0, kLow = 1 };

class Idle {
 public:
  explicit Idle(Fidelity adam_idle, const std::string& method = "option2vec")
      : algorithm_(MakeRunAlgorithm(
            SmallConfig(method, Fidelity::kPaper, {"adam_idle=" + ToString(adam_idle)}),
            Sizes(5, 3))),
        rng_(5, "batch"),
        flagged_(RandomBatch(5, 3, algorithm_->NumOptions(), 24, rng_)),
        unflagged_(flagged_) {
    std::fill(unflagged_.init.begin(), unflagged_.init.end(), 0);
  }

  /// Whether a step of the stage moves a tensor.
  bool Moves(const std::string& name, Stage stage, bool flagged) {
    const Mat before = FindParam(*algorithm_, name).value;
    algorithm_->Loss(stage, flagged ? flagged_ : unflagged_, nullptr);
    algorithm_->Step(stage);
    return FindParam(*algorithm_, name).value != before;
  }

 private:
  std::unique_ptr<Algorithm> algorithm_;
  Rng rng_;
  Batch flagged_, unflagged_;
};

/// A tensor that a method's high stage alone uses.
constexpr std::pair<const char*, const char*> kOfHighStage[] = {{"option2vec", "embed.W_o"},
                                                                {"dac_ppo", "option2.beta.head.W"},
                                                                {"dac_onestep", "policy.head.W"}};

TEST(IdleTensors, OfTheOtherStageRestInPaper) {
  for (const auto& [method, tensor] : kOfHighStage) {
    Idle idle(Fidelity::kPaper, method);
    EXPECT_TRUE(idle.Moves(tensor, kHigh, true)) << method;
    EXPECT_FALSE(idle.Moves(tensor, kLow, true)) << method;
  }
}

TEST(IdleTensors, OfTheOtherStageMoveByMomentumInReleased) {
  for (const auto& [method, tensor] : kOfHighStage) {
    Idle idle(Fidelity::kReleased, method);
    EXPECT_FALSE(idle.Moves(tensor, kLow, true)) << method;  // never had a gradient
    EXPECT_TRUE(idle.Moves(tensor, kHigh, true)) << method;
    EXPECT_TRUE(idle.Moves(tensor, kLow, true)) << method;
  }
}

TEST(IdleTensors, OfTheInitialNetBelongToTheOptionStageInPaper) {
  Idle idle(Fidelity::kPaper);
  EXPECT_FALSE(idle.Moves("init.0.W", kHigh, false));  // gradient zero and no momentum yet
  EXPECT_TRUE(idle.Moves("init.0.W", kHigh, true));
  EXPECT_TRUE(idle.Moves("init.0.W", kHigh, false));
  EXPECT_FALSE(idle.Moves("init.0.W", kLow, true));
}

TEST(IdleTensors, OfTheInitialNetStartWithTheFirstFlaggedRowInReleased) {
  Idle idle(Fidelity::kReleased);
  EXPECT_FALSE(idle.Moves("init.0.W", kHigh, false));
  EXPECT_TRUE(idle.Moves("init.0.W", kHigh, true));
  EXPECT_TRUE(idle.Moves("init.0.W", kHigh, false));
  EXPECT_TRUE(idle.Moves("init.0.W", kLow, true));
}

/// Counts Adam's steps.
class StepCounts final : public StateVisitor {
 public:
  void Matrix(std::string_view, Mat&) override {}
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view name, std::int64_t* x, std::size_t n) override {
    if (name == "adam.t") t.assign(x, x + n);
  }
  std::vector<std::int64_t> t;  // of each parameter
};

TEST(IdleTensors, OfTheInitialNetStartTheirCountLateInReleased) {
  // A paper network counts the step without flagged rows, a released one does not; spec 2.7.
  for (const Fidelity rule : {Fidelity::kPaper, Fidelity::kReleased}) {
    const auto algorithm = MakeRunAlgorithm(
        SmallConfig("option2vec", Fidelity::kPaper, {"adam_idle=" + ToString(rule)}), Sizes(5, 3));
    Rng rng(5, "batch");
    Batch batch = RandomBatch(5, 3, algorithm->NumOptions(), 24, rng);
    const std::vector<char> flags = batch.init;
    std::fill(batch.init.begin(), batch.init.end(), 0);
    algorithm->Loss(kHigh, batch, nullptr);
    algorithm->Step(kHigh);
    batch.init = flags;
    algorithm->Loss(kHigh, batch, nullptr);
    algorithm->Step(kHigh);
    StepCounts counts;
    algorithm->Serialize(counts);
    const std::vector<Param*> params = algorithm->Params();
    for (std::size_t i = 0; i < params.size(); ++i) {
      if (!params[i]->name.starts_with("init.")) continue;
      EXPECT_EQ(counts.t[i], rule == Fidelity::kPaper ? 2 : 1) << params[i]->name;
    }
  }
}

TEST(Minibatches, OfARemainderAreUsed) {
  // 2 workers x 9 steps = 18 samples in minibatches of 8, 8 and 2; 2 epochs.
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    if (!HasRatio(method.id)) continue;  // one step on everything
    const RunConfig config = SmallConfig(method.id, Fidelity::kPaper, {"rollout=9"});
    VecEnv env = PointTask(config.workers, /*time_limit=*/5);
    const auto algorithm = MakeRunAlgorithm(config, env.Spec());
    Iterate(*algorithm, env);
    StepCounts counts;
    algorithm->Serialize(counts);
    for (std::size_t i = 0; i < counts.t.size(); ++i) {
      int stages = 0;
      for (std::size_t stage = 0; stage < algorithm->StageNames().size(); ++stage) {
        stages += algorithm->InGraph(int(stage))[i];
      }
      EXPECT_EQ(counts.t[i], 3 * 2 * stages) << method.id << ", " << algorithm->Params()[i]->name;
    }
  }
}

}  // namespace
}  // namespace o2v
