// What a run leaves behind that diverges in the middle of a rollout.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "base/csv.h"
#include "base/decimal.h"
#include "fake_run.h"
#include "report/summary.h"
#include "run/record.h"

namespace o2v {
namespace {

/// The fake task, which diverges at a step counted over all workers and tasks; 100 more reward a
/// step on the second task.
class DivergingEnv final : public Env {
 public:
  DivergingEnv(int task, std::int64_t& left) : task_(task), left_(left) {}
  const EnvSpec& Spec() const override { return env_.Spec(); }
  void Reset(Rng& rng, std::span<double> obs) override { env_.Reset(rng, obs); }
  StepResult Step(std::span<const double> a, std::span<double> obs) override {
    if (--left_ == 0) throw DivergedError("bad qacc");
    StepResult result = env_.Step(a, obs);
    result.reward += 100 * task_;
    return result;
  }
  void Serialize(StateVisitor& v, const std::string& prefix) override { env_.Serialize(v, prefix); }

 private:
  FakeEnv env_;
  const int task_;
  std::int64_t& left_;
};

/// Mean return of the last 20 of the episodes that ended at or before `step`.
double Smoothed(const std::vector<CurvePoint>& episodes, std::int64_t step) {
  std::vector<double> returns;
  for (const auto& [at, ret] : episodes) {
    if (at <= step) returns.push_back(ret);
  }
  double sum = 0;
  for (std::size_t i = returns.size() - 20; i < returns.size(); ++i) sum += returns[i];
  return sum / 20;
}

class Divergence : public testing::Test {
 protected:
  /// A run that diverges in its step number `at`, counted from 1, or not at all.
  void Run(const std::string& name, std::int64_t at = 0) {
    left_ = at;
    std::ostringstream progress;
    const auto train = [&] { Train(config_, parts_, dir_ / name, false, progress, false); };
    if (at > 0) {
      EXPECT_THROW(train(), DivergedError);
    } else {
      train();
    }
  }
  std::vector<CurvePoint> Episodes(const std::string& name) {
    return ReadEpisodes(dir_ / name / "episodes.csv");
  }

  TestFolder dir_;
  RunConfig config_ = FakeConfig();  // 2 workers, 10 steps an iteration
  std::int64_t left_ = 0;
  RunParts parts_ = [this] {
    RunParts parts = FakeParts(config_);
    parts.make_env = [this](int task) { return std::make_unique<DivergingEnv>(task, left_); };
    return parts;
  }();
};

TEST_F(Divergence, KeepsTheEpisodesOfItsRolloutAndNoOthers) {
  config_.eval_every = 0;
  Run("whole");
  const std::vector<CurvePoint> whole = Episodes("whole");
  std::size_t of_last_rollouts = 0;
  // The odd steps are those of the first worker. One step of both workers is whole or not at all.
  for (std::int64_t at = 91; at <= 99; at += 2) {
    const std::string name = std::to_string(at);
    Run(name, at);
    std::vector<CurvePoint> expected;
    for (const CurvePoint& episode : whole) {
      // An episode of step t ended in the workers' step from t - t % 2 on.
      if (episode.first < at - 1) expected.push_back(episode);
    }
    EXPECT_EQ(Episodes(name), expected) << at;
    of_last_rollouts += std::size_t(
        std::count_if(expected.begin(), expected.end(), [](auto& e) { return e.first >= 90; }));
    EXPECT_EQ(ReadManifest(dir_ / name)->steps, at - 1);
  }
  EXPECT_GT(of_last_rollouts, 0u) << "episodes end in the rollout that diverges";
}

TEST_F(Divergence, EndsTheCurveWhereItHappened) {
  config_.eval_every = 0;
  config_.steps = 50'000;
  config_.checkpoint_every = 10'000;
  Run("run", 25'003);
  const std::vector<CurvePoint> episodes = Episodes("run");
  std::string expected = "step,return_20\n";
  for (const std::int64_t step : {10'000, 20'000, 25'002}) {
    expected += Decimal(step) + "," + Decimal(Smoothed(episodes, step)) + "\n";
  }
  EXPECT_EQ(ReadFile(dir_ / "run.csv"), expected);
  const RecordHead record = ReadRecordHead(dir_ / "run.json");
  EXPECT_EQ(record.status, RunStatus::kDiverged);
  EXPECT_EQ(record.steps, 25'002);
}

TEST_F(Divergence, OfTheSecondTaskKeepsTheReturnOfTheFirst) {
  config_.eval_every = 0;
  config_.steps = 40'000;
  config_.checkpoint_every = 10'000;
  parts_.tasks = 2;
  Run("run", 30'001);
  const std::vector<CurvePoint> episodes = Episodes("run");
  const double first = Smoothed(episodes, 20'000), last = Smoothed(episodes, 30'000);
  EXPECT_LT(first, 0);
  EXPECT_GT(last, 0);
  const CsvTable curve = ReadCsv(dir_ / "run.csv");
  ASSERT_EQ(curve.Rows(), 3u);
  EXPECT_EQ(curve.At(1, 0), 20'000);
  EXPECT_EQ(curve.At(1, 1), first);
  EXPECT_EQ(curve.At(2, 0), 30'000);
  EXPECT_EQ(curve.At(2, 1), last);
}

/// A record of a run over the two tasks of a pair, of 40 000 steps in all.
void WritePairRecord(const std::filesystem::path& folder, int seed, RunStatus status,
                     std::int64_t steps, const std::string& curve) {
  RunRequest request;
  request.task = "Cheetah";
  request.algorithm = "ppo";
  request.steps = 40'000;
  request.seed = seed;
  Manifest manifest;
  manifest.status = status;
  manifest.steps = steps;
  const std::string name = "paper/Cheetah/ppo/seed-00" + std::to_string(seed);
  std::filesystem::create_directories((folder / name).parent_path());
  WriteFileAtomically(folder / (name + ".csv"), "step,return_20\n" + curve);
  WriteFileAtomically(folder / (name + ".json"),
                      RecordJson(ManifestJson(manifest), ToToml(ResolveRun(request))));
}

TEST_F(Divergence, CountsForTheTaskInWhichItHappenedOnly) {
  const std::filesystem::path results = dir_ / "results";
  WritePairRecord(results, 0, RunStatus::kDone, 40'000, "10000,0\n20000,5\n30000,1\n40000,8\n");
  WritePairRecord(results, 1, RunStatus::kDiverged, 35'000, "20000,7\n30000,2\n35000,3\n");
  WritePairRecord(results, 2, RunStatus::kDiverged, 20'000, "10000,4\n20000,9\n");
  WritePairRecord(results, 3, RunStatus::kDiverged, 19'998, "10000,6\n19998,1\n");
  const auto rows = Summarize(results).rows;
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].step, 20'000);
  EXPECT_EQ(rows[0].values, (std::vector<double>{5, 7, 9}));
  EXPECT_EQ(rows[0].n_diverged, 1);
  EXPECT_EQ(rows[1].step, 40'000);
  EXPECT_EQ(rows[1].values, (std::vector<double>{8}));
  EXPECT_EQ(rows[1].n_diverged, 3);
}

}  // namespace
}  // namespace o2v
