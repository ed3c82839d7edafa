#include "harness/jobs.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "base/check.h"
#include "base/files.h"
#include "harness/record.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;

class Jobs : public testing::Test {
 protected:
  void SetUp() override { fs::remove_all(results_); }
  void TearDown() override { fs::remove_all(results_); }

  JobQuery Query() const {
    JobQuery query;
    query.program = "./option2vec";
    query.configs = {"quick"};
    query.results = results_;
    return query;
  }
  /// Leaves behind what a run with this status does.
  void Leave(const Job& job, RunStatus status, int revision = 1) const {
    fs::create_directories(job.dir);
    WriteFileAtomically(job.dir / "config.toml", ToToml(job.config));
    Manifest manifest;
    manifest.status = status;
    WriteManifest(job.dir, manifest);
    if (status != RunStatus::kDone && status != RunStatus::kDiverged) return;
    manifest.revision = revision;
    WriteFileAtomically(RecordPath(job.dir, ".json"),
                        RecordJson(ManifestJson(manifest), ToToml(job.config)));
  }

  const fs::path results_ =
      fs::path(testing::TempDir()) /
      (std::string("jobs_") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(Jobs, AreTheProductOfTheListsWithSeedsOutermost) {
  const auto jobs = ListJobs(Query());
  ASSERT_EQ(jobs.size(), 8u);  // 2 tasks, 2 methods, 1 fidelity, 2 seeds
  EXPECT_EQ(jobs[0].dir, results_ / "quick/paper/InvertedPendulum-v2/ppo/seed-000");
  EXPECT_EQ(jobs[7].dir, results_ / "quick/paper/HalfCheetah-v2/option2vec/seed-001");
}

TEST_F(Jobs, AreCommandsThatStartOrGoOn) {
  JobQuery query = Query();
  query.results = "results";
  query.tasks = {"HalfCheetah-v2"};
  query.algorithms = {"ppo"};
  query.seeds = {12};
  const auto jobs = ListJobs(query);
  ASSERT_EQ(jobs.size(), 1u);
  const std::string steps = std::to_string(jobs[0].config.steps);
  EXPECT_EQ(jobs[0].command,
            "./option2vec train --config quick --task HalfCheetah-v2 --algo ppo --fidelity paper "
            "--seed 12 --steps " +
                steps + " --out results/quick/paper/HalfCheetah-v2/ppo/seed-012 --resume");
}

TEST_F(Jobs, OfSeveralExperimentsGoSeedBySeedToo) {
  JobQuery query = Query();
  query.configs = {"single_task", "transfer"};
  query.algorithms = {"ppo"};
  query.fidelities = {"paper"};
  query.seeds = {3, 5};
  const auto jobs = ListJobs(query);
  ASSERT_EQ(jobs.size(), 2u * (10 + 6));
  for (std::size_t i = 0; i < jobs.size(); ++i) EXPECT_EQ(jobs[i].config.seed, i < 16 ? 3u : 5u);
  EXPECT_EQ(jobs[10].dir, results_ / "transfer/paper/CartPole/ppo/seed-003");
}

TEST_F(Jobs, QuoteWordsForTheShell) {
  JobQuery query = Query();
  query.program = "/a b/it's";
  EXPECT_EQ(ListJobs(query)[0].command.substr(0, 20), "'/a b/it'\\''s' train");
}

TEST_F(Jobs, ListsOfTheQueryReplaceTheExperiments) {
  JobQuery query = Query();
  query.tasks = {"Hopper-v2", "Ant-v2", "Swimmer-v2"};
  query.algorithms = {"ppo"};
  query.fidelities = {"released"};
  query.seeds = {5};
  const auto jobs = ListJobs(query);
  ASSERT_EQ(jobs.size(), 3u);
  EXPECT_EQ(jobs[2].config.task, "Swimmer-v2");
  EXPECT_EQ(jobs[2].config.fidelity, Fidelity::kReleased);
  EXPECT_EQ(jobs[2].config.seed, 5u);
}

TEST_F(Jobs, FinishedAndDivergedRunsNeedNothingMore) {
  const auto before = ListJobs(Query());
  Leave(before[0], RunStatus::kDone);
  Leave(before[1], RunStatus::kDiverged);
  Leave(before[2], RunStatus::kStopped);
  Leave(before[3], RunStatus::kRunning);
  const auto jobs = ListJobs(Query());
  EXPECT_EQ(jobs[0].finished, RunStatus::kDone);
  EXPECT_EQ(jobs[1].finished, RunStatus::kDiverged);
  EXPECT_FALSE(jobs[2].finished);
  EXPECT_FALSE(jobs[3].finished);
  EXPECT_FALSE(jobs[4].finished);
}

TEST_F(Jobs, TheRecordIsEnoughToSkipARun) {
  const Job job = ListJobs(Query())[0];
  Leave(job, RunStatus::kDone);
  fs::remove_all(job.dir);  // the raw folder is on another machine
  EXPECT_EQ(ListJobs(Query())[0].finished, RunStatus::kDone);
  EXPECT_FALSE(ListJobs(Query())[0].old);
}

TEST_F(Jobs, ARecordOfAnOlderRevisionIsMarked) {
  const Job job = ListJobs(Query())[0];
  Leave(job, RunStatus::kDone, FindAlgorithm(job.config.algorithm).revision - 1);
  EXPECT_TRUE(ListJobs(Query())[0].old);
}

TEST_F(Jobs, PairsAreTasks) {
  JobQuery query = Query();
  query.configs = {"transfer"};
  query.tasks = {"Cheetah"};
  query.algorithms = {"ppo"};
  query.fidelities = {"released"};
  query.seeds = {0};
  const auto jobs = ListJobs(query);
  ASSERT_EQ(jobs.size(), 1u);
  EXPECT_EQ(jobs[0].dir, results_ / "transfer/released/Cheetah/ppo/seed-000");
  EXPECT_EQ(jobs[0].config.task, "dm-cheetah-run,dm-cheetah-backward");
  EXPECT_EQ(jobs[0].config.steps, 2'000'000);
}

TEST_F(Jobs, ARunFinishedWithAnotherConfigIsRefused) {
  Job job = ListJobs(Query())[0];
  job.config.steps += 1;
  Leave(job, RunStatus::kDone);
  EXPECT_THROW(ListJobs(Query()), ConfigError);
}

TEST_F(Jobs, EveryExperimentOfTheProgramResolves) {
  for (const char* name : {"quick", "ci", "single_task", "transfer"}) {
    JobQuery query = Query();
    query.configs = {name};
    EXPECT_FALSE(ListJobs(query).empty()) << name;
  }
}

TEST(ParseSeeds, ReadsNumbersAndRanges) {
  EXPECT_EQ(ParseSeeds("0-2,7"), (std::vector<std::uint64_t>{0, 1, 2, 7}));
  EXPECT_EQ(ParseSeeds("9223372036854775807").front(), 9223372036854775807u);
}

TEST(ParseSeeds, RefusesEverythingElse) {
  for (const char* text : {"", ",", "1,", "-1", "3-1", "1-", "a", "1 2", "0-99999999",
                           "9223372036854775808", "99999999999999999999"}) {
    EXPECT_THROW(ParseSeeds(text), ConfigError) << text;
  }
}

}  // namespace
}  // namespace o2v
