// What a method says about an update: the row of updates.csv.

#include <gtest/gtest.h>

#include <cmath>

#include "algo/setup.h"
#include "algo/statistics.h"

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
      for (const std::string& stage : algorithm->StageNames()) {
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

TEST(OptionUsage, IsTheSameWhereverRolloutsCutIt) {
  // Option 0 is executed for 3 and 3 steps, option 1 for 2, option 2 never; the ninth step begins
  // an episode, and with it an execution of option 0 of 1 step: means 7 / 3 and 2.
  const std::vector<int> o = {0, 0, 0, 1, 1, 0, 0, 0, 0};
  for (const int rollout : {1, 2, 4, 9}) {
    OptionUsage usage(3);
    std::vector<SumAndCount> sums(6), ratios;
    for (int t = 0; t < int(o.size()); ++t) {
      usage.Count(o[std::size_t(t)], t > 0 ? o[std::size_t(t - 1)] : 0, t == 0 || t == 8);
      if ((t + 1) % rollout != 0 && t + 1 < int(o.size())) continue;
      ratios.clear();
      usage.Report(ratios);
      usage.Clear();
      ASSERT_EQ(ratios.size(), sums.size());
      for (std::size_t i = 0; i < sums.size(); ++i) {
        sums[i].sum += ratios[i].sum;
        sums[i].n += ratios[i].n;
      }
    }
    std::vector<double> values;
    for (const SumAndCount& sum : sums) values.push_back(sum.Value());
    EXPECT_EQ(values, (std::vector<double>{7.0 / 9, 2.0 / 9, 0, 7.0 / 3, 2, 0})) << rollout;
  }
}

TEST(Statistics, OfOptionsAreOfTheStepsSinceTheUpdateBefore) {
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    const RunConfig config = SmallConfig(method.id, Fidelity::kPaper);
    VecEnv env = PointTask(config.workers, /*time_limit=*/5);
    const auto algorithm = MakeRunAlgorithm(config, env.Spec());
    const std::vector<std::string> names = algorithm->StatNames();
    std::vector<Episode> episodes;
    for (int update = 0; update < 3; ++update) {
      const std::int64_t before = env.TotalSteps();
      algorithm->Collect(env, episodes);
      const double steps = double(env.TotalSteps() - before);
      const std::vector<SumAndCount>& stats = algorithm->Update();
      double used = 0;
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (!names[i].starts_with("usage_")) continue;
        EXPECT_EQ(stats[i].n, steps) << method.id << ", " << names[i] << ", update " << update;
        used += stats[i].sum;
      }
      EXPECT_EQ(used, method.id == "ppo" ? 0 : steps) << method.id << ", update " << update;
    }
  }
}

TEST(Statistics, AreAsManyAsTheirNames) {
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    const RunConfig config = SmallConfig(method.id, Fidelity::kPaper);
    VecEnv env = PointTask(config.workers, /*time_limit=*/5);
    const auto algorithm = MakeRunAlgorithm(config, env.Spec());
    for (int update = 0; update < 2; ++update) {
      EXPECT_EQ(Iterate(*algorithm, env).size(), algorithm->StatNames().size()) << method.id;
    }
  }
}

TEST(LossMeans, AverageTheMinibatches) {
  LossMeans means;
  LossTerms terms;
  terms.total = 1;
  means.Add(terms, 2);
  terms.total = 5;
  means.Add(terms, 4);
  std::vector<SumAndCount> ratios;
  std::vector<std::string> names;
  means.Report(ratios);
  LossMeans::Names("low", names);
  ASSERT_EQ(ratios.size(), names.size());
  EXPECT_EQ(names.front(), "loss_low");
  EXPECT_EQ(ratios.front().n, 2);
  EXPECT_EQ(ratios.front().Value(), 3);
  EXPECT_EQ(names.back(), "grad_norm_low");
  EXPECT_EQ(ratios.back().Value(), 3);
}

TEST(LossMeans, HaveTheColumnsOfAMethodBesideTheirOwn) {
  const LossColumns more = {{"master", &LossTerms::master},
                            {"termination", &LossTerms::termination}};
  LossMeans means(more);
  LossTerms terms;
  terms.master = 2;
  terms.termination = 7;
  means.Add(terms, 1);
  means.Clear();
  terms.termination = 8;
  means.Add(terms, 1);
  std::vector<SumAndCount> ratios;
  std::vector<std::string> names;
  means.Report(ratios);
  LossMeans::Names("all", names, more);
  EXPECT_EQ(names, (std::vector<std::string>{"loss_all", "surrogate_all", "value_loss_all",
                                             "entropy_all", "kl_all", "clip_fraction_all",
                                             "master_all", "termination_all", "grad_norm_all"}));
  std::vector<double> values;
  for (const SumAndCount& ratio : ratios) values.push_back(ratio.Value());
  EXPECT_EQ(values, (std::vector<double>{0, 0, 0, 0, 0, 0, 2, 8, 1}));
}

}  // namespace
}  // namespace o2v
