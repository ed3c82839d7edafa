// What the networks say before they have learnt anything.

#include <gtest/gtest.h>

#include <cmath>

#include "algo/setup.h"
#include "small_hyper.h"

namespace o2v {
namespace {

constexpr Fidelity kFidelities[] = {Fidelity::kPaper, Fidelity::kReleased};

TEST(Init, ActionsStartAtMeanZeroAndSigmaLn2) {
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    for (const Fidelity fidelity : kFidelities) {
      const auto algorithm = MakeRunAlgorithm(SmallConfig(method.id, fidelity), Sizes(5, 3));
      Rng rng(2, "init");
      const Batch batch = RandomBatch(5, 3, algorithm->NumOptions(), 50, rng);
      Mat mu, sigma;
      algorithm->ActionPolicy(batch.s, batch.o, mu, sigma);
      // Heads of gain 1e-3 on hidden values of order 1; softplus(0) = ln 2 = 0.6931.
      EXPECT_LT(mu.cwiseAbs().maxCoeff(), 0.02) << method.id;
      EXPECT_LT((sigma.array() - Real(std::log(2.0))).abs().maxCoeff(), 0.02) << method.id;
    }
  }
}

TEST(Init, OptionsAreDrawnWithProbabilitiesThatSumToOne) {
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    for (const Fidelity fidelity : kFidelities) {
      const auto algorithm = MakeRunAlgorithm(SmallConfig(method.id, fidelity), Sizes(5, 3));
      Rng rng(2, "init");
      const Batch batch = RandomBatch(5, 3, algorithm->NumOptions(), 50, rng);
      Mat P;
      algorithm->OptionPolicy(batch.s, batch.o_prev, batch.init, P);
      EXPECT_GE(P.minCoeff(), 0) << method.id;
      EXPECT_LT((P.colwise().sum().array() - Real(1)).abs().maxCoeff(), 1e-6) << method.id;
    }
  }
}

TEST(Init, HalfOfThePreviousOptionsAreStopped) {
  // beta = 1/2 and pi = 1/4 but for heads of gain 1e-3: P(o') = 1/2 + 1/2 1/4, the others 1/8.
  for (const char* method : {"dac_ppo", "ppoc", "ahp_ppo", "iopg"}) {
    const auto algorithm = MakeRunAlgorithm(SmallConfig(method, Fidelity::kPaper), Sizes(5, 3));
    Rng rng(2, "init");
    const Batch batch = RandomBatch(5, 3, 4, 50, rng);
    Mat P, expected(4, 50);
    algorithm->OptionPolicy(batch.s, batch.o_prev, batch.init, P);
    for (Index b = 0; b < 50; ++b) {
      const std::size_t i = std::size_t(b);
      expected.col(b).setConstant(batch.init[i] ? Real(0.25) : Real(0.125));
      if (!batch.init[i]) expected(batch.o_prev[i], b) = Real(0.625);
    }
    EXPECT_LT((P - expected).cwiseAbs().maxCoeff(), 0.005) << method;
  }
}

TEST(Init, HeadsAreOrthogonalWithTheirGain) {
  // Spec 2.1, 2.6: rows (or columns, where there are fewer) have the length of the gain, 1e-3 but
  // for option logits and critic of Option2Vec, and are orthogonal.
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    for (const Fidelity fidelity : kFidelities) {
      const auto algorithm = MakeRunAlgorithm(SmallConfig(method.id, fidelity), Sizes(5, 3));
      int heads = 0;
      for (const Param* p : algorithm->Params()) {
        const std::string& name = p->name;
        const bool o2v = method.id == "option2vec";
        const bool small = o2v ? name == "action.mu.W" || name == "action.sigma.W"
                               : name.ends_with(".head.W") || name == "critic.v.W" ||
                                     name == "critic.q.W" || name == "critic.u.W";
        const bool unit = o2v ? name == "logits.W" || name == "critic.q.W"
                              : name.find(".body.") != std::string::npos && name.ends_with(".W");
        const bool counted_only = method.id == "dac_onestep" && name == "critic.u.W";  // zeros
        if ((!small && !unit) || counted_only) continue;
        ++heads;
        const MatD W = p->value.cast<double>() / (small ? 1e-3 : 1.0);
        const MatD gram = W.rows() <= W.cols() ? MatD(W * W.transpose()) : MatD(W.transpose() * W);
        EXPECT_TRUE(gram.isIdentity(1e-4)) << method.id << ", " << name << "\n" << gram;
      }
      const int K = algorithm->NumOptions();
      const int nets = method.id == "ppo" ? 2 : method.id == "dac_onestep" ? 2 + K : 2 + 2 * K;
      if (method.id == "option2vec") {
        EXPECT_EQ(heads, 4);
      } else {  // two layers and a head each, and a head that counts only
        EXPECT_GE(heads, 3 * nets) << method.id;
      }
    }
  }
}

TEST(Init, DependsOnTheSeed) {
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    RunConfig config = SmallConfig(method.id, Fidelity::kPaper);
    const auto one = MakeRunAlgorithm(config, Sizes(5, 3));
    const auto same = MakeRunAlgorithm(config, Sizes(5, 3));
    config.seed = 2;
    const auto other = MakeRunAlgorithm(config, Sizes(5, 3));
    EXPECT_EQ(one->Params()[0]->value, same->Params()[0]->value) << method.id;
    EXPECT_NE(one->Params()[0]->value, other->Params()[0]->value) << method.id;
  }
}

TEST(Init, EmbeddingsOfOptionsAreOrthonormal) {
  const auto algorithm = MakeRunAlgorithm(SmallConfig("option2vec", Fidelity::kPaper), Sizes(5, 3));
  const Mat& E = FindParam(*algorithm, "embed.W_o").value;  // (D, K), K <= D
  EXPECT_TRUE((E.transpose() * E).isIdentity(1e-5));
}

TEST(Init, TheInitialOptionNetHasAWidthOfItsOwn) {
  const auto algorithm = MakeRunAlgorithm(
      SmallConfig("option2vec", Fidelity::kPaper, {"hidden=8", "init_hidden=16"}), Sizes(5, 3));
  const auto shape = [&](const char* name) {
    const Mat& W = FindParam(*algorithm, name).value;
    return std::pair(W.rows(), W.cols());
  };
  EXPECT_EQ(shape("init.0.W"), std::pair(Index(16), Index(5)));
  EXPECT_EQ(shape("init.1.W"), std::pair(Index(4), Index(16)));
  EXPECT_EQ(shape("action.body.1.W"), std::pair(Index(8), Index(8)));
}

TEST(Init, ActivationsAreTheTwoThatHaveANumber) {
  AlgorithmInput in{.S = 5, .A = 3, .workers = 2, .switches = SwitchesFor(Fidelity::kPaper)};
  for (const double number : {0, 1, 2, 7}) {
    const Settings hyper = SmallHyper({{"activation", number}});
    in.hyper = &hyper;
    std::string message;
    try {
      MakeAlgorithm("ppo", in);
    } catch (const ConfigError& e) {
      message = e.what();
    }
    EXPECT_EQ(message, number < 2
                           ? ""
                           : Concat("activation: ", number, " is neither 0 (tanh) nor 1 (relu)"));
  }
}

TEST(Init, AttentionIsXavierOverTheWholeInProjection) {
  const auto algorithm = MakeRunAlgorithm(
      SmallConfig("option2vec", Fidelity::kReleased, {"embedding=40"}), Sizes(5, 3));
  for (const char* name : {"attention.in.Wq", "attention.in.Wk", "attention.in.Wv"}) {
    const Mat& W = FindParam(*algorithm, name).value;
    const double a = std::sqrt(6.0 / (4 * 40));  // fan_in D, fan_out 3 D; spec 2.6 item 5
    EXPECT_LE(W.cwiseAbs().maxCoeff(), a) << name;
    EXPECT_GT(W.cwiseAbs().maxCoeff(), 0.98 * a) << name;  // 1600 uniform entries
  }
}

}  // namespace
}  // namespace o2v
