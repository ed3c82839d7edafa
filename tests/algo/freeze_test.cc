// What stays constant of Option2Vec from the second task on (spec 6, switch o2v_freeze).

#include <gtest/gtest.h>

#include "algo/setup.h"
#include "memory_visitor.h"

namespace o2v {
namespace {

enum Stage { kHigh = 0, kLow = 1 };

std::unique_ptr<Algorithm> Small(Freeze freeze, Fidelity adam_idle) {
  RunConfig config =
      SmallConfig("option2vec", Fidelity::kPaper, {"adam_idle=" + ToString(adam_idle)});
  config.switches.o2v_freeze = freeze;
  return MakeRunAlgorithm(config, Sizes(5, 3));
}

struct Frozen {
  explicit Frozen(Freeze freeze, Fidelity adam_idle = Fidelity::kReleased)
      : algorithm(Small(freeze, adam_idle)), rng(5, "batch"), batch(RandomBatch(5, 3, 4, 64, rng)) {
    Step(kHigh);  // so that every tensor has momentum
    Step(kLow);
    algorithm->ChangeTask();
  }
  void Step(int stage) {
    algorithm->Loss(stage, batch, nullptr);
    algorithm->Step(stage);
  }
  const Mat& Value(const std::string& name) { return FindParam(*algorithm, name).value; }

  std::unique_ptr<Algorithm> algorithm;
  Rng rng;
  Batch batch;
};

TEST(Freeze, PaperHoldsTheEmbeddingAndTrainsTheRest) {
  for (const Fidelity idle : {Fidelity::kPaper, Fidelity::kReleased}) {
    Frozen f(Freeze::kPaper, idle);
    const Mat W_o = f.Value("embed.W_o");
    for (const Param* p : f.algorithm->Params()) {
      const Mat before = p->value;
      for (const int stage : {kHigh, kLow}) f.Step(stage);
      if (p->name == "attention.in.bk") continue;  // its gradient is 0 but for rounding
      EXPECT_EQ(p->value == before, p->name == "embed.W_o") << p->name;
    }
    EXPECT_TRUE(f.Value("embed.W_o") == W_o);
  }
}

TEST(Freeze, ReleasedLetsMomentumMoveTheEmbeddingUntilItHasDecayed) {
  Frozen f(Freeze::kReleased);
  double moved[2];
  for (double& distance : moved) {
    const Mat before = f.Value("embed.W_o");
    for (int i = 0; i < 100; ++i) f.Step(kHigh);
    distance = double((f.Value("embed.W_o") - before).norm());
  }
  EXPECT_GT(moved[0], 1e-3);             // lr 3e-4, a few steps of it each of 24 entries
  EXPECT_LT(moved[1], 1e-3 * moved[0]);  // 0.9^100 is 3e-5
}

TEST(Freeze, ReleasedHoldsTheEmbeddingWhereIdleTensorsAreSkipped) {
  Frozen f(Freeze::kReleased, Fidelity::kPaper);
  const Mat W_o = f.Value("embed.W_o");
  f.Step(kHigh);
  EXPECT_TRUE(f.Value("embed.W_o") == W_o);
}

TEST(Freeze, PolicyLeavesOnlyActionNetAndCriticToLearn) {
  Frozen f(Freeze::kPolicy, Fidelity::kPaper);
  f.algorithm->Loss(kHigh, f.batch, nullptr);
  for (const Param* p : f.algorithm->Params()) {
    EXPECT_EQ(p->grad.cwiseAbs().maxCoeff() > 0, p->name.starts_with("critic.")) << p->name;
  }
  ZeroGrad(f.algorithm->Params());
  f.algorithm->Loss(kLow, f.batch, nullptr);
  EXPECT_GT(FindParam(*f.algorithm, "action.mu.W").grad.norm(), 0);
}

TEST(Freeze, OtherGradientsAreThoseOfNoFreeze) {
  Frozen none(Freeze::kNone), paper(Freeze::kPaper), policy(Freeze::kPolicy);
  for (Frozen* f : {&none, &paper, &policy}) f->algorithm->Loss(kHigh, f->batch, nullptr);
  const auto params = none.algorithm->Params();
  for (std::size_t i = 0; i < params.size(); ++i) {
    const Param &a = *params[i], &b = *paper.algorithm->Params()[i],
                &c = *policy.algorithm->Params()[i];
    if (a.name == "embed.W_o") {
      EXPECT_GT(a.grad.norm(), 0);
      EXPECT_EQ(b.grad.norm(), 0);
    } else {
      EXPECT_TRUE(a.grad == b.grad) << a.name;
    }
    if (a.name.starts_with("critic.")) {
      EXPECT_TRUE(a.grad == c.grad) << a.name;
    }
  }
}

TEST(Freeze, BelongsToTheStateOfAResumedRun) {
  Frozen before(Freeze::kPaper);
  MemoryVisitor memory;
  before.algorithm->Serialize(memory);
  std::unique_ptr<Algorithm> after = Small(Freeze::kPaper, Fidelity::kReleased);
  memory.load = true;
  after->Serialize(memory);
  const Mat W_o = FindParam(*after, "embed.W_o").value;
  after->Loss(kHigh, before.batch, nullptr);
  after->Step(kHigh);
  EXPECT_TRUE(FindParam(*after, "embed.W_o").value == W_o);
}

}  // namespace
}  // namespace o2v
