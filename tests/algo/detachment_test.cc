// Which tensors a loss of Option2Vec reaches (spec 10.3, 4.8 d).

#include <gtest/gtest.h>

#include "algo/setup.h"

namespace o2v {
namespace {

enum Stage { kHigh = 0, kLow = 1 };
constexpr Fidelity kFidelities[] = {Fidelity::kPaper, Fidelity::kReleased};

struct Reached {
  explicit Reached(const RunConfig& config)
      : algorithm(MakeRunAlgorithm(config, Sizes(5, 3))), rng(5, "batch") {
    batch = RandomBatch(5, 3, algorithm->NumOptions(), 24, rng);
  }
  double Gradient(const std::string& name) {
    return FindParam(*algorithm, name).grad.cwiseAbs().maxCoeff();
  }

  std::unique_ptr<Algorithm> algorithm;
  Rng rng;
  Batch batch;
};

TEST(Detachment, TheActionLossDoesNotReachTheEmbeddings) {
  for (const Fidelity fidelity : kFidelities) {
    Reached r(SmallConfig("option2vec", fidelity));
    r.algorithm->Loss(kLow, r.batch, nullptr);
    EXPECT_EQ(r.Gradient("embed.W_o"), 0);
    EXPECT_GT(r.Gradient("action.body.0.W"), 0);  // it reads them
  }
}

TEST(Detachment, TheOptionLossReachesTheEmbeddings) {
  for (const Fidelity fidelity : kFidelities) {
    Reached r(SmallConfig("option2vec", fidelity));
    r.algorithm->Loss(kHigh, r.batch, nullptr);
    EXPECT_GT(r.Gradient("embed.W_o"), 0);
  }
}

TEST(Detachment, TheCriticDoesNotReachTheEmbeddings) {
  // Without advantages and entropy only the value loss is left.
  Reached r(SmallConfig("option2vec", Fidelity::kPaper, {"entropy_weight_option=0"}));
  r.batch.high.adv_hat.setZero();
  r.algorithm->Loss(kHigh, r.batch, nullptr);
  EXPECT_EQ(r.Gradient("embed.W_o"), 0);
  EXPECT_GT(r.Gradient("critic.body.0.W"), 0);
}

TEST(Detachment, AStageReachesItsTensorsAlone) {
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    for (const Fidelity fidelity : kFidelities) {
      Reached r(SmallConfig(method.id, fidelity));
      const std::vector<Param*> params = r.algorithm->Params();
      for (std::size_t stage = 0; stage < r.algorithm->Stages().size(); ++stage) {
        r.algorithm->Loss(int(stage), r.batch, nullptr);
        const std::vector<char> in_graph = r.algorithm->InGraph(int(stage));
        for (std::size_t i = 0; i < params.size(); ++i) {
          const bool reached = params[i]->grad.cwiseAbs().maxCoeff() > 0;
          // A key bias adds the same to all scores of a query: its gradient is 0 but for rounding.
          if (params[i]->name == "attention.in.bk") continue;
          EXPECT_EQ(reached, bool(in_graph[i]))
              << method.id << ", stage " << stage << ", " << params[i]->name;
        }
        ZeroGrad(params);
      }
    }
  }
}

}  // namespace
}  // namespace o2v
