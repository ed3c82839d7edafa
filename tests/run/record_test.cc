#include "run/record.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/check.h"
#include "base/decimal.h"
#include "fake_run.h"

namespace o2v {
namespace {

TEST(RecordCsv, HoldsTheLastSmoothedValueAtOrBeforeTheGridStep) {
  // 230 episodes: the 100th ends at step 10 000 (mean of 81..100), the 200th at 20 000.
  EXPECT_EQ(RecordCsv(Rising(230), {}, 21'000),
            "step,return_20\n10000,90.5\n20000,190.5\n21000,200.5\n");
  // Just before the 100th episode counts the 99th.
  auto late = Rising(100);
  late[99].first = 10'001;
  EXPECT_EQ(RecordCsv(late, {}, 10'000), "step,return_20\n10000,89.5\n");
}

TEST(RecordCsv, HoldsTheOptionsOfTheUpdatesSinceTheGridStepBefore) {
  // Up to 10 000 two updates. Option 0: 2000 steps in 200 executions, 4500 in 300: 6500 of 8000
  // steps, 6500 / 500 = 13. Option 1: not used, 1500 steps in 750 executions: 1500 / 8000, 2 steps.
  // Up to 20 000 none, the next one stands for it: option 0 is not used, option 1 all the time.
  // Up to 30 000 this and another. Option 0: 2000 of 20 000 steps in 500 executions. Option 1:
  // 16 000 steps of one execution, or of one begun before, and 2000 of one: 18 000 / 2.
  const CsvTable updates{
      "updates.csv",
      {"step", "loss", "usage_0", "usage_1", "duration_0_steps", "duration_1_steps"},
      {2'000,  9, 1,    0,    10, 0,       //
       8'000,  9, 0.75, 0.25, 15, 2,       //
       24'000, 9, 0,    1,    0,  16'000,  //
       28'000, 9, 0.5,  0.5,  4,  2'000}};
  EXPECT_EQ(RecordCsv(Rising(300), updates, 30'000),
            "step,return_20,usage_0,usage_1,duration_0_steps,duration_1_steps\n"
            "10000,90.5,0.8125,0.1875,13,2\n"
            "20000,190.5,0,1,,16000\n"
            "30000,290.5,0.1,0.9,4,9000\n");
}

TEST(RecordCsv, CountsAnUpdateOnAGridStepToItAndOneBesideItToTheNext) {
  // Up to 10 000: 9999 steps with option 0, in 99 executions, and the one step of the update that
  // ends there, with option 1. Up to 20 000: one step of option 1, 9999 of option 0 in 3
  // executions. Up to 30 000: 10 000 steps of option 1 in 20.
  const CsvTable updates{"updates.csv",
                         {"step", "usage_0", "usage_1", "duration_0_steps", "duration_1_steps"},
                         {9'999,  1, 0, 101,   0,  //
                          10'000, 0, 1, 0,     1,  //
                          10'001, 0, 1, 0,     1,  //
                          20'000, 1, 0, 3'333, 0,  //
                          30'000, 0, 1, 0,     500}};
  EXPECT_EQ(RecordCsv(Rising(300), updates, 30'000),
            "step,return_20,usage_0,usage_1,duration_0_steps,duration_1_steps\n"
            "10000,90.5,0.9999,1e-04,101,1\n"
            "20000,190.5,0.9999,1e-04,3333,1\n"
            "30000,290.5,0,1,,500\n");
}

TEST(RecordCsv, EndsWithTheLastStepWhereItIsBesideTheGrid) {
  // The 101st episode ends at 10 100: its mean is that of 82..101.
  EXPECT_EQ(RecordCsv(Rising(300), {}, 10'001), "step,return_20\n10000,90.5\n10001,90.5\n");
  EXPECT_EQ(RecordCsv(Rising(300), {}, 10'100), "step,return_20\n10000,90.5\n10100,91.5\n");
  EXPECT_EQ(RecordCsv(Rising(300), {}, 9'999), "step,return_20\n9999,89.5\n");
}

TEST(RecordCsv, AddsUpStepsAndExecutionsAsWholeNumbers) {
  // 1 of 3000 steps in 1 execution, 27 of 3000 in 13: 28 of 6000 in 14. The products and quotients
  // of these shares and durations are not all whole. After it an update alone: its own numbers.
  const CsvTable updates{"updates.csv",
                         {"step", "usage_0", "duration_0_steps"},
                         {3'000, 1.0 / 3000, 1,           //
                          6'000, 27.0 / 3000, 27.0 / 13,  //
                          14'192, 3000.0 / 8192, 3000.0 / 7}};
  EXPECT_EQ(RecordCsv(Rising(200), updates, 20'000),
            Concat("step,return_20,usage_0,duration_0_steps\n10000,90.5,", Decimal(28.0 / 6000),
                   ",2\n20000,190.5,", Decimal(3000.0 / 8192), ",", Decimal(3000.0 / 7), "\n"));
}

TEST(RecordCsv, HasNoRowBeforeTheFirstValue) {
  auto late = Rising(20);
  late[19].first = 15'000;
  EXPECT_EQ(RecordCsv(late, {}, 20'000), "step,return_20\n20000,10.5\n");
  EXPECT_EQ(RecordCsv(Rising(19), {}, 20'000), "step,return_20\n");
}

TEST(RecordJson, HoldsConfigBuildRevisionAndCostButNoDate) {
  Manifest manifest;
  manifest.status = RunStatus::kDone;
  manifest.start = "2026-01-02T03:04:05Z";
  manifest.steps = 12;
  manifest.cpu_seconds = 2.5;
  manifest.revision = 3;
  const auto json = nlohmann::json::parse(RecordJson(ManifestJson(manifest), "[run]\nseed = 1\n"));
  EXPECT_EQ(json.at("status"), "done");
  EXPECT_EQ(json.at("steps"), 12);
  EXPECT_EQ(json.at("config"), "[run]\nseed = 1\n");
  EXPECT_EQ(json.at("revision"), 3);
  EXPECT_EQ(json.at("cpu_seconds"), 2.5);
  EXPECT_TRUE(json.contains("commit"));
  EXPECT_FALSE(json.contains("start"));
  EXPECT_EQ(json.at("format"), 1);
}

TEST(ReadRecord, OfBeforeThereWereRevisionsIsOfTheFirst) {
  TestFolder dir;
  RunRequest request;
  request.task = "Hopper-v2";
  request.algorithm = "ppo";
  const std::string config = ToToml(ResolveRun(request));
  const nlohmann::json old = {
      {"status", "diverged"}, {"steps", 7}, {"cpu_seconds", 1.5}, {"config", config}};
  WriteFileAtomically(dir / "a.json", old.dump());
  for (const char* name : {"a.csv", "b.csv"}) WriteFileAtomically(dir / name, "step,return_20\n");
  EXPECT_EQ(ReadRecord(dir / "a.json").revision, 1);
  EXPECT_EQ(ReadRecord(dir / "a.json").cpu_seconds, 1.5);
  Manifest manifest;
  manifest.status = RunStatus::kDiverged;
  manifest.revision = 2;
  WriteFileAtomically(dir / "b.json", RecordJson(ManifestJson(manifest), config));
  EXPECT_EQ(ReadRecord(dir / "b.json").revision, 2);
}

TEST(ReadRecord, RefusesADamagedFile) {
  TestFolder dir;
  WriteFileAtomically(dir / "a.json", R"({"status": "done", "steps": 7)");
  EXPECT_THROW(ReadRecord(dir / "a.json"), Error);
}

TEST(WriteRecord, OfTheFolderOfAFinishedRunIsWhatTheRunWrote) {
  TestFolder dir;
  const RunConfig config = FakeConfig();
  std::ostringstream progress;
  Train(config, FakeParts(config), dir / "run", false, progress, false);
  const std::string csv = ReadFile(dir / "run.csv"), json = ReadFile(dir / "run.json");
  EXPECT_NE(csv.find("\n200,"), std::string::npos) << csv;
  std::filesystem::remove(dir / "run.csv");
  std::filesystem::remove(dir / "run.json");
  WriteRecord(dir / "run", ReadFile(dir / "run" / "manifest.json"), config.steps);
  EXPECT_EQ(ReadFile(dir / "run.csv"), csv);
  EXPECT_EQ(ReadFile(dir / "run.json"), json);
}

}  // namespace
}  // namespace o2v
