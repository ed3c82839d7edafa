// Which tensors a loss reaches, and what it holds constant (spec 4, 10.3).

#include <gtest/gtest.h>

#include "algo/setup.h"

namespace o2v {
namespace {

enum Stage { kHigh = 0, kLow = 1 };
constexpr int kAll = 0;  // the stage of a method with one
constexpr Fidelity kFidelities[] = {Fidelity::kPaper, Fidelity::kReleased};

struct Reached {
  explicit Reached(const std::string& method, Fidelity fidelity = Fidelity::kPaper,
                   const std::vector<std::string>& set = {})
      : algorithm(MakeRunAlgorithm(SmallConfig(method, fidelity, set), Sizes(5, 3))),
        rng(5, "batch"),
        batch(RandomBatch(5, 3, algorithm->NumOptions(), 64, rng)) {}

  LossTerms Loss(int stage) { return algorithm->Loss(stage, batch, nullptr); }
  /// max |g| of the tensors with `part` in their names.
  double Gradient(const std::string& part) {
    double largest = -1;
    for (const Param* p : algorithm->Params()) {
      if (p->name.find(part) == std::string::npos) continue;
      largest = std::max(largest, double(p->grad.cwiseAbs().maxCoeff()));
    }
    Check(largest >= 0, "no parameter ", part);
    return largest;
  }
  /// Gradients of these tensors after the loss.
  std::vector<Mat> Gradients(int stage, const std::string& part) {
    ZeroGrad(algorithm->Params());
    Loss(stage);
    std::vector<Mat> gradients;
    for (const Param* p : algorithm->Params()) {
      if (p->name.find(part) != std::string::npos) gradients.push_back(p->grad);
    }
    Check(!gradients.empty(), "no parameter ", part);
    return gradients;
  }
  /// Targets equal to the values that the loss compares them with: no value loss.
  void TargetsAreValuesTaken() {
    Mat q;
    algorithm->OptionValues(batch.s, batch.o, q);
    for (Index b = 0; b < batch.Size(); ++b) batch.action.ret(b) = q(batch.o[std::size_t(b)], b);
  }

  std::unique_ptr<Algorithm> algorithm;
  Rng rng;
  Batch batch;
};

TEST(Detachment, AStageReachesItsTensorsAlone) {
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    for (const Fidelity fidelity : kFidelities) {
      Reached r(method.id, fidelity);
      const std::vector<Param*> params = r.algorithm->Params();
      for (std::size_t stage = 0; stage < r.algorithm->StageNames().size(); ++stage) {
        r.Loss(int(stage));
        const std::vector<char> in_graph = r.algorithm->InGraph(int(stage));
        for (std::size_t i = 0; i < params.size(); ++i) {
          const bool reached = params[i]->grad.cwiseAbs().maxCoeff() > 0;
          // A key bias adds the same to all scores of a query: its gradient is 0 but for rounding.
          if (params[i]->name == "attention.in.bk") continue;
          // In the graph with gradient zero: every step of an episode is a first one (spec 4.5
          // (g)).
          if (method.id == "iopg" && fidelity == Fidelity::kReleased &&
              params[i]->name.find(".beta.") != std::string::npos) {
            EXPECT_FALSE(reached);
            continue;
          }
          EXPECT_EQ(reached, bool(in_graph[i])) << method.id << ", " << ToString(fidelity)
                                                << ", stage " << stage << ", " << params[i]->name;
        }
        ZeroGrad(params);
      }
    }
  }
}

// ---- Option2Vec ---------------------------------------------------------------------------------

TEST(Detachment, OfOption2VecTheActionLossDoesNotReachTheEmbeddings) {
  for (const Fidelity fidelity : kFidelities) {
    Reached r("option2vec", fidelity);
    r.Loss(kLow);
    EXPECT_EQ(r.Gradient("embed.W_o"), 0);
    EXPECT_GT(r.Gradient("action.body.0.W"), 0);  // it reads them
  }
}

TEST(Detachment, OfOption2VecTheOptionLossReachesTheEmbeddings) {
  for (const Fidelity fidelity : kFidelities) {
    Reached r("option2vec", fidelity);
    r.Loss(kHigh);
    EXPECT_GT(r.Gradient("embed.W_o"), 0);
  }
}

TEST(Detachment, OfOption2VecTheCriticDoesNotReachTheEmbeddings) {
  // Without advantages and entropy only the value loss is left.
  Reached r("option2vec", Fidelity::kPaper, {"entropy_weight_option=0"});
  r.batch.option.adv_hat.setZero();
  r.Loss(kHigh);
  EXPECT_EQ(r.Gradient("embed.W_o"), 0);
  EXPECT_GT(r.Gradient("critic.body.0.W"), 0);
}

// ---- DAC and DAC-OneStep ------------------------------------------------------------------------

TEST(Detachment, OfDacTheLowStageLeavesTheOptionPolicyAlone) {
  for (const Fidelity fidelity : kFidelities) {
    Reached dac("dac_ppo", fidelity), one("dac_onestep", fidelity);
    dac.Loss(kLow);
    one.Loss(kLow);
    for (const char* part : {"master.", ".beta."}) EXPECT_EQ(dac.Gradient(part), 0) << part;
    EXPECT_EQ(one.Gradient(fidelity == Fidelity::kPaper ? "policy." : "master."), 0);
    for (Reached* r : {&dac, &one}) {
      for (const char* part : {".mu.", ".rho", "critic.q"}) EXPECT_GT(r->Gradient(part), 0) << part;
    }
  }
}

TEST(Detachment, OfDacTheHighStageLeavesTheIntraOptionPoliciesAlone) {
  for (const char* method : {"dac_ppo", "dac_onestep"}) {
    for (const Fidelity fidelity : kFidelities) {
      Reached r(method, fidelity);
      r.Loss(kHigh);
      for (const char* part : {".mu.", ".rho"}) EXPECT_EQ(r.Gradient(part), 0) << method << part;
    }
  }
}

TEST(Detachment, OfDacTheValueLossHoldsTheOptionPolicyConstant) {
  for (const Fidelity fidelity : kFidelities) {
    Reached dac("dac_ppo", fidelity, {"entropy_weight=0"});
    Reached one("dac_onestep", fidelity, {"entropy_weight=0"});
    for (Reached* r : {&dac, &one}) {
      r->batch.option.adv_hat.setZero();
      r->Loss(kHigh);
      EXPECT_GT(r->Gradient("critic.q"), 0);
    }
    for (const char* part : {"master.", ".beta."}) EXPECT_EQ(dac.Gradient(part), 0) << part;
    EXPECT_EQ(one.Gradient(fidelity == Fidelity::kPaper ? "policy." : "ynet."), 0);
  }
}

TEST(Detachment, OfReleasedOneStepTheNetOfTheOptionServesFirstStatesAlone) {
  Reached r("dac_onestep", Fidelity::kReleased);
  std::fill(r.batch.init.begin(), r.batch.init.end(), 0);
  r.Loss(kHigh);
  EXPECT_EQ(r.Gradient("master."), 0);
  EXPECT_GT(r.Gradient("ynet."), 0);
  ZeroGrad(r.algorithm->Params());
  std::fill(r.batch.init.begin(), r.batch.init.end(), 1);
  r.Loss(kHigh);
  EXPECT_GT(r.Gradient("master."), 0);
  EXPECT_EQ(r.Gradient("ynet."), 0);
}

// ---- PPOC ---------------------------------------------------------------------------------------

TEST(Detachment, OfPpocTheTerminationTermHoldsCriticAndMasterConstant) {
  for (const Fidelity fidelity : kFidelities) {
    Reached r("ppoc", fidelity, {"entropy_weight=0"});
    r.batch.action.adv_hat.setZero();
    r.TargetsAreValuesTaken();
    EXPECT_NE(r.Loss(kAll).termination, 0);
    EXPECT_GT(r.Gradient(".beta."), 0);
    EXPECT_EQ(r.Gradient("critic."), 0);
    EXPECT_EQ(r.Gradient("master."), 0);
  }
}

TEST(Detachment, OfPpocTheMastersWeightIsConstant) {
  // It holds beta, which the advantages do not reach through it.
  Reached r("ppoc");
  const std::vector<Mat> with = r.Gradients(kAll, ".beta.");
  r.batch.action.adv_hat.setZero();
  EXPECT_EQ(r.Gradients(kAll, ".beta."), with);
}

// ---- OC -----------------------------------------------------------------------------------------

/// Keeps the target network.
class TargetNetwork final : public StateVisitor {
 public:
  explicit TargetNetwork(Algorithm& algorithm) { algorithm.Serialize(*this); }
  void Matrix(std::string_view name, Mat& x) override {
    if (name.starts_with("target.")) weights.push_back(x);
  }
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view, std::int64_t*, std::size_t) override {}
  std::vector<Mat> weights;
};

TEST(Detachment, OfOcTheLossLeavesTargetNetworkAndMasterAlone) {
  for (const Fidelity fidelity : kFidelities) {
    Reached r("oc", fidelity);
    const std::vector<Mat> before = TargetNetwork(*r.algorithm).weights;
    const Mat q = FindParam(*r.algorithm, "critic.q.W").value;
    const Mat z = FindParam(*r.algorithm, "master.head.W").value;
    r.Loss(kAll);
    EXPECT_EQ(r.Gradient("master."), 0);
    r.algorithm->Step(kAll);
    EXPECT_FALSE(before.empty());
    EXPECT_EQ(TargetNetwork(*r.algorithm).weights, before);
    EXPECT_NE(FindParam(*r.algorithm, "critic.q.W").value, q);
    EXPECT_EQ(FindParam(*r.algorithm, "master.head.W").value, z);
  }
}

TEST(Detachment, OfOcAdvantagesAreConstant) {
  // What the critic learns depends neither on the actions, whose log-densities its advantages
  // weigh, nor on the terminations, which its regrets weigh.
  Reached r("oc");
  const std::vector<Mat> critic = r.Gradients(kAll, "critic.");
  r.batch.a *= 2;
  FindParam(*r.algorithm, "option1.beta.head.b").value.setConstant(2);
  EXPECT_EQ(r.Gradients(kAll, "critic."), critic);
  r.batch.r *= 2;
  EXPECT_NE(r.Gradients(kAll, "critic."), critic);
}

// ---- AHP+PPO ------------------------------------------------------------------------------------

TEST(Detachment, OfAhpFirstStatesReachTerminationsInReleasedOnly) {
  for (const Fidelity fidelity : kFidelities) {
    Reached r("ahp_ppo", fidelity);
    std::fill(r.batch.init.begin(), r.batch.init.end(), 1);
    std::fill(r.batch.stop.begin(), r.batch.stop.end(), 1);
    r.Loss(kAll);
    EXPECT_EQ(r.Gradient(".beta.") > 0, fidelity == Fidelity::kReleased);
    EXPECT_GT(r.Gradient("master."), 0);
  }
}

TEST(Detachment, OfAhpAContinuedOptionDoesNotReachTheMaster) {
  for (const Fidelity fidelity : kFidelities) {
    Reached r("ahp_ppo", fidelity);
    std::fill(r.batch.init.begin(), r.batch.init.end(), 0);
    std::fill(r.batch.stop.begin(), r.batch.stop.end(), 0);
    r.batch.o = r.batch.o_prev;
    r.Loss(kAll);
    EXPECT_EQ(r.Gradient("master."), 0);
    EXPECT_GT(r.Gradient(".beta."), 0);
  }
}

TEST(Detachment, OfAhpAValueConcernsOneEntryOfU) {
  // At first states the last one, elsewhere that of o'.
  Reached r("ahp_ppo");
  for (const char init : {1, 0}) {
    std::fill(r.batch.init.begin(), r.batch.init.end(), init);
    std::fill(r.batch.o_prev.begin(), r.batch.o_prev.end(), 2);
    ZeroGrad(r.algorithm->Params());
    r.Loss(kAll);
    const Mat& b = FindParam(*r.algorithm, "critic.u.b").grad;
    for (Index k = 0; k < 5; ++k) EXPECT_EQ(b(k) != 0, k == (init ? 4 : 2)) << k;
  }
}

// ---- IOPG ---------------------------------------------------------------------------------------

TEST(Detachment, OfIopgTerminationsLearnInPaperOnly) {
  for (const Fidelity fidelity : kFidelities) {
    Reached r("iopg", fidelity);
    r.Loss(kAll);
    EXPECT_EQ(r.Gradient(".beta.") > 0, fidelity == Fidelity::kPaper);
    EXPECT_GT(r.Gradient("master."), 0);
  }
}

TEST(Detachment, OfIopgTheValueIsTheFirstOutputAlone) {
  Reached r("iopg");
  r.Loss(kAll);
  const Mat& b = FindParam(*r.algorithm, "critic.q.b").grad;
  for (Index k = 0; k < 4; ++k) EXPECT_EQ(b(k) != 0, k == 0) << k;
}

TEST(Detachment, OfIopgAdvantagesAreConstant) {
  // What the critic learns does not depend on the actions, whose log-densities its advantages
  // weigh.
  Reached r("iopg");
  const std::vector<Mat> critic = r.Gradients(kAll, "critic.");
  r.batch.a *= 2;
  EXPECT_EQ(r.Gradients(kAll, "critic."), critic);
}

}  // namespace
}  // namespace o2v
