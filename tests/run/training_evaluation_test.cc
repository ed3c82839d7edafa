// Evaluations during training: they change no byte of it, and are of the policy, the task and the
// sampled actions that they should be.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "algo/setup.h"
#include "base/csv.h"
#include "fake_run.h"
#include "run/checkpoint.h"
#include "run/evaluate.h"

namespace o2v {
namespace {

/// Bytes of a checkpoint's tensors by name; without those that say how long evals.csv is.
std::map<std::string, std::string> Tensors(const std::filesystem::path& path) {
  const std::string text = ReadFile(path);
  std::uint64_t length = 0;
  std::memcpy(&length, text.data(), sizeof length);
  const auto header = nlohmann::json::parse(text.substr(8, length));
  std::map<std::string, std::string> tensors;
  for (const auto& [name, entry] : header.items()) {
    if (name == "__metadata__" || name.starts_with("training.evals.")) continue;
    const std::size_t begin = entry["data_offsets"][0], end = entry["data_offsets"][1];
    tensors[name] = text.substr(8 + length + begin, end - begin);
  }
  return tensors;
}

class TrainingEvaluation : public testing::Test {
 protected:
  void Run(const RunConfig& config, const RunParts& parts, const std::string& name) {
    std::ostringstream progress;
    Train(config, parts, dir_ / name, /*resume=*/false, progress, /*terminal=*/false);
  }
  TestFolder dir_;
};

class EveryMethod : public TrainingEvaluation, public testing::WithParamInterface<std::string> {};

TEST_P(EveryMethod, IsTrainedToTheSameBytesWithAndWithoutEvaluations) {
  for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
    RunConfig config = SmallConfig(GetParam(), fidelity);  // `released` has dropout
    config.steps = 240;
    const RunParts parts = {[](int) { return std::make_unique<FakeEnv>(); },
                            [&](const EnvSpec& spec) { return MakeRunAlgorithm(config, spec); }};
    const std::string with = ToString(fidelity) + "-with", without = ToString(fidelity);
    config.eval_every = 24;
    config.eval_episodes = 3;
    Run(config, parts, with);
    config.eval_every = 0;
    Run(config, parts, without);
    for (const char* file : {"episodes.csv", "updates.csv"}) {
      EXPECT_EQ(ReadFile(dir_ / with / file), ReadFile(dir_ / without / file)) << file;
    }
    EXPECT_TRUE(Tensors(dir_ / with / "last.ckpt") == Tensors(dir_ / without / "last.ckpt"));
    EXPECT_GE(ReadCsv(dir_ / with / "evals.csv").Rows(), 3u * 9) << "evaluations took place";
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, EveryMethod, testing::ValuesIn(MethodIds()),
                         [](const auto& info) { return info.param; });

TEST_F(TrainingEvaluation, IsOfThePolicyThatTheUpdateLeft) {
  // At the end, after 200 steps, that is the policy of last.ckpt; actions are sampled, the seed is
  // the run's own.
  const RunConfig config = FakeConfig();
  Run(config, FakeParts(config), "run");
  FakeEnv env;
  FakeAlgorithm policy(env.Spec(), /*seed=*/99);
  Normalizer normalizer(2);
  LoadPolicy(dir_ / "run" / "last.ckpt", policy, normalizer);
  const auto expected = Evaluate(policy, normalizer, env, 2, /*sample_action=*/true, config.seed);
  const CsvTable evals = ReadCsv(dir_ / "run" / "evals.csv");
  ASSERT_EQ(evals.columns, (std::vector<std::string>{"step", "episode", "return"}));
  ASSERT_EQ(evals.Rows(), 8u);  // two each at 50, 100, 150 and 200
  for (std::size_t row = 0; row < 8; ++row) {
    EXPECT_EQ(evals.At(row, 0), 50 * double(row / 2 + 1));
    EXPECT_EQ(evals.At(row, 1), double(row % 2));
  }
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(evals.At(6 + i, 2), expected[i].ret);
}

TEST_F(TrainingEvaluation, StandsAtTheStepOfItsUpdate) {
  // Updates every 10 steps: the first ones at or beyond 35, 70, 105, 140 and 175.
  RunConfig config = FakeConfig();
  config.eval_every = 35;
  Run(config, FakeParts(config), "run");
  const CsvTable evals = ReadCsv(dir_ / "run" / "evals.csv");
  ASSERT_EQ(evals.Rows(), 10u);
  const std::vector<double> steps = {40, 70, 110, 140, 180};
  for (std::size_t row = 0; row < 10; ++row) EXPECT_EQ(evals.At(row, 0), steps[row / 2]);
}

TEST_F(TrainingEvaluation, IsOnTheTaskOfTheMoment) {
  // 1000 more reward a step on the second task, from the update at 110 steps on.
  struct SecondTask final : Env {
    explicit SecondTask(int task) : task(task) {}
    const EnvSpec& Spec() const override { return env.Spec(); }
    void Reset(Rng& rng, std::span<double> obs) override { env.Reset(rng, obs); }
    StepResult Step(std::span<const double> a, std::span<double> obs) override {
      StepResult result = env.Step(a, obs);
      result.reward += 1000 * task;
      return result;
    }
    void Serialize(StateVisitor& v, const std::string& prefix) override {
      env.Serialize(v, prefix);
    }
    FakeEnv env;
    int task;
  };
  RunConfig config = FakeConfig();
  config.eval_every = 10;
  RunParts parts = FakeParts(config);
  parts.tasks = 2;
  parts.make_env = [](int task) { return std::make_unique<SecondTask>(task); };
  Run(config, parts, "run");
  const CsvTable evals = ReadCsv(dir_ / "run" / "evals.csv");
  ASSERT_EQ(evals.Rows(), 40u);
  for (std::size_t row = 0; row < 40; ++row) {
    // The evaluation at 110 is of what was learned on the first task, and still on it.
    EXPECT_EQ(evals.At(row, 2) > 0, evals.At(row, 0) > 110) << evals.At(row, 0);
  }
}

// ---- Dropout is off in all that the networks are asked.

TEST(Dropout, IsOffInEveryQuery) {
  FakeEnv env;
  Rng rng(5, "states");
  const Index B = 40;
  Mat s(2, B);
  for (Index i = 0; i < s.size(); ++i) s(i) = static_cast<Real>(rng.Normal());
  std::vector<int> o, o_prev;
  std::vector<char> init;
  for (Index b = 0; b < B; ++b) {
    o.push_back(int(b % 4));
    o_prev.push_back(int(b / 4 % 4));
    init.push_back(b % 5 == 0);
  }
  const auto answers = [&](const std::string& dropout) {
    const RunConfig config =
        SmallConfig("option2vec", Fidelity::kReleased, {"o2v_dropout=" + dropout});
    const auto policy = MakeRunAlgorithm(config, env.Spec());  // the same weights: the same seed
    // Masks have been drawn and acted with.
    VecEnv workers([] { return std::make_unique<FakeEnv>(); }, config.workers, /*seed=*/1);
    workers.Reset();
    std::vector<Episode> episodes;
    policy->Collect(workers, episodes);
    Mat P, mu, sigma, q;
    MatD J;
    policy->OptionPolicy(s, o_prev, init, P);
    policy->ActionPolicy(s, o, mu, sigma);
    policy->OptionValues(s, o, q);
    policy->MeanJacobian(s, o, J);
    std::vector<double> returns;
    for (const auto& e : Evaluate(*policy, Normalizer(2), env, 20, /*sample_action=*/true, 7)) {
      returns.push_back(e.ret);
    }
    return std::tuple(P, mu, sigma, q, J, returns);
  };
  const auto off = answers("0");
  EXPECT_TRUE(answers("0.9") == off);
  const Mat& P = std::get<0>(off);
  EXPECT_GT((P.col(1) - P.col(7)).norm(), 1e-3) << "P depends on its inputs";
}

}  // namespace
}  // namespace o2v
