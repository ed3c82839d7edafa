// What a method says about an update: the row of updates.csv.

#include <gtest/gtest.h>

#include <cmath>

#include "algo/setup.h"

namespace o2v {
namespace {

/// Weight of the entropy in a stage's loss (spec 4).
double EntropyWeight(const RunConfig& config, const std::string& stage) {
  const std::string& method = config.algorithm;
  if (method == "option2vec") {
    return config.hyper.Real(stage == "high" ? "entropy_weight_option" : "entropy_weight_action");
  }
  const bool none = stage == "low" || method == "ahp_ppo" || method == "iopg";
  return none ? 0 : config.hyper.Real("entropy_weight");
}

TEST(Statistics, OfTheTermsOfALossAddUpToIt) {
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
      const RunConfig config = SmallConfig(method.id, fidelity);
      VecEnv env = PointTask(config.workers, /*time_limit=*/5);
      const auto algorithm = MakeRunAlgorithm(config, env.Spec());
      const std::vector<double> stats = Iterate(*algorithm, env);
      for (const std::string& stage : algorithm->Stages()) {
        const auto term = [&](const std::string& name) {
          return Stat(*algorithm, stats, name + "_" + stage);
        };
        double sum =
            term("surrogate") + term("value_loss") - EntropyWeight(config, stage) * term("entropy");
        if (method.id == "ppoc") sum += term("master");
        if (method.id == "ppoc" || method.id == "oc") sum += term("termination");
        EXPECT_NEAR(sum, term("loss"), 1e-9 * std::abs(sum))
            << method.id << ", " << ToString(fidelity) << ", " << stage;
      }
    }
  }
}

TEST(Statistics, OfTheOptionCriticsShowTheirTerminations) {
  for (const char* method : {"ppoc", "oc"}) {
    const RunConfig config = SmallConfig(method, Fidelity::kPaper, {"termination_penalty=2"});
    VecEnv env = PointTask(config.workers, /*time_limit=*/100);
    const auto algorithm = MakeRunAlgorithm(config, env.Spec());
    const std::vector<double> stats = Iterate(*algorithm, env);
    // beta = 1/2 at the start, differences of q are of the order of its head's gain 1e-3, and 2 of
    // the 24 samples are first states: 1/2 * 2 * 22 / 24.
    EXPECT_NEAR(Stat(*algorithm, stats, "termination_all"), 22.0 / 24, 0.03) << method;
  }
}

}  // namespace
}  // namespace o2v
