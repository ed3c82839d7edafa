// IOPG's bookkeeping of episodes (spec 4.5).

#include <gtest/gtest.h>

#include <cmath>

#include "algo/setup.h"

namespace o2v {
namespace {

TEST(Iopg, RefusesEpisodesLongerThanTwoTimeLimits) {
  // Made for a task of 4 steps, so with room for 8; the task's episodes have 9.
  VecEnv env = PointTask(/*workers=*/2, /*time_limit=*/9);
  EnvSpec spec = env.Spec();
  spec.time_limit = 4;
  const auto iopg = MakeRunAlgorithm(SmallConfig("iopg", Fidelity::kPaper), spec);
  std::vector<Episode> episodes;
  EXPECT_THROW(iopg->Collect(env, episodes), Error);
  EXPECT_EQ(env.TotalSteps(), 2 * 8);
}

/// Shows every worker's episode as `length` steps long.
class LengthSetter final : public StateVisitor {
 public:
  explicit LengthSetter(std::int64_t length) : length_(length) {}
  void Matrix(std::string_view, Mat&) override {}
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view name, std::int64_t* x, std::size_t) override {
    if (name.ends_with(".length")) *x = length_;
  }

 private:
  const std::int64_t length_;
};

TEST(Iopg, RefusesAStateWhoseEpisodeIsLongerThanItsRoom) {
  EnvSpec spec = Sizes(5, 3);
  spec.time_limit = 4;  // room for 8
  const auto iopg = MakeRunAlgorithm(SmallConfig("iopg", Fidelity::kPaper), spec);
  LengthSetter room(8), more(9);
  EXPECT_NO_THROW(iopg->Serialize(room));
  EXPECT_THROW(iopg->Serialize(more), Error);
}

TEST(Iopg, ReportsTheLossOfDensitiesBeyondTheRangeOfExponentials) {
  // All weights 0: mu = a = 0, v = 0, and all options alike; c = N(0; 0, sigma^2) in A dimensions.
  constexpr Index A = 40, n = 4;
  const RunConfig config = SmallConfig("iopg", Fidelity::kReleased);
  const auto iopg = MakeRunAlgorithm(config, Sizes(5, A));
  for (Param* p : iopg->Params()) p->value.setConstant(p->name.ends_with(".rho") ? -60 : 0);
  Rng rng(5, "episode");
  Batch episode = RandomBatch(5, A, 4, n, rng);
  episode.a.setZero();
  episode.r = VecD::Unit(n, n - 1);  // R_t = A_t = gamma^(n - 1 - t)
  double sum = 0;
  for (int t = 0; t < n; ++t) sum += std::pow(config.hyper.Real("gamma"), t);
  const double log_c = double(A) * (60 - 0.5 * std::log(2 * M_PI));  // sigma = e^-60; 2363
  const double expected = -sum / double(n) * log_c;
  EXPECT_NEAR(iopg->Loss(0, episode, nullptr).surrogate / expected, 1, 1e-5);
}

/// The gradients that an episode of n steps, always the same one, leaves behind.
std::vector<Mat> GradientsOf(Algorithm& iopg, Index n) {
  Rng rng(5, "episode");
  Batch episode = RandomBatch(5, 3, 4, n, rng);
  episode.init.assign(std::size_t(n), 0);
  episode.init[0] = 1;
  for (Param* p : iopg.Params()) p->grad.setZero();
  iopg.Loss(0, episode, nullptr);
  std::vector<Mat> gradients;
  for (const Param* p : iopg.Params()) gradients.push_back(p->grad);
  return gradients;
}

TEST(Iopg, GradientsDoNotDependOnTheEpisodeBefore) {
  // Episodes pass in blocks of 64 steps; what a longer one left in them must not count.
  const RunConfig config = SmallConfig("iopg", Fidelity::kPaper);
  const auto fresh = MakeRunAlgorithm(config, Sizes(5, 3)),
             used = MakeRunAlgorithm(config, Sizes(5, 3));
  const std::vector<Mat> expected = GradientsOf(*fresh, 5);
  GradientsOf(*used, 150);
  GradientsOf(*used, 70);
  const std::vector<Mat> found = GradientsOf(*used, 5);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(found[i], expected[i]) << fresh->Params()[i]->name;
  }
}

TEST(Iopg, AnOptionThatTheMasterNeverTakesHasNoGradientAndSpoilsNoOther) {
  // A logit 200 below the others: all that is left of its probability are the last bits of floats.
  for (const char* init_flag : {"iopg_init_flag=paper", "iopg_init_flag=released"}) {
    for (const char* posterior : {"iopg_posterior=paper", "iopg_posterior=released"}) {
      const RunConfig config = SmallConfig("iopg", Fidelity::kPaper, {init_flag, posterior});
      const auto iopg = MakeRunAlgorithm(config, Sizes(5, 3));
      const std::string last = "option" + std::to_string(iopg->NumOptions() - 1) + ".";
      for (Param* p : iopg->Params()) {
        if (p->name == "master.head.b") p->value(iopg->NumOptions() - 1, 0) = -200;
      }
      const std::vector<Mat> gradients = GradientsOf(*iopg, 6);
      for (std::size_t i = 0; i < gradients.size(); ++i) {
        const std::string& name = iopg->Params()[i]->name;
        EXPECT_TRUE(gradients[i].allFinite()) << name << " " << init_flag << " " << posterior;
        if (name.starts_with(last)) {
          EXPECT_LT(gradients[i].cwiseAbs().maxCoeff(), 1e-30) << name;
        }
        if (name == "option0.mu.head.W") {
          EXPECT_GT(gradients[i].cwiseAbs().maxCoeff(), 0);
        }
      }
    }
  }
}

/// Steps of the running episode of each worker's copy.
class Lengths final : public StateVisitor {
 public:
  explicit Lengths(Algorithm& iopg) { iopg.Serialize(*this); }
  void Matrix(std::string_view, Mat&) override {}
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view name, std::int64_t* x, std::size_t) override {
    if (name.ends_with(".length")) lengths.push_back(*x);
  }
  std::vector<std::int64_t> lengths;
};

TEST(Iopg, ForgetsEveryWorkersEpisodeAtAChangeOfTaskUnlessReleased) {
  for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
    const RunConfig config = SmallConfig("iopg", fidelity, {"workers=4"});
    int made = 0;
    VecEnv env([&] { return std::make_unique<PointEnv>(made++ == 2 ? 5 : 9); }, 4, /*seed=*/3);
    env.Reset();
    const auto iopg = MakeRunAlgorithm(config, env.Spec());
    Iterate(*iopg, env);  // ends with the third worker's episode
    using Steps = std::vector<std::int64_t>;
    EXPECT_EQ(Lengths(*iopg).lengths, (Steps{5, 5, 0, 5}));
    iopg->ChangeTask();
    EXPECT_EQ(Lengths(*iopg).lengths,
              fidelity == Fidelity::kPaper ? (Steps{0, 0, 0, 0}) : (Steps{5, 5, 0, 5}));
  }
}

}  // namespace
}  // namespace o2v
