#include "harness/record.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

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
  // Two updates up to 10 000, none up to 20 000 (the next one stands for it), one up to 30 000.
  const CsvTable updates{"updates.csv",
                         {"step", "loss", "usage_0", "duration_0_steps"},
                         {4'000, 9, 0.25, 1, 8'000, 9, 0.75, 2, 24'000, 9, 0.5, 6}};
  EXPECT_EQ(RecordCsv(Rising(300), updates, 30'000),
            "step,return_20,usage_0,duration_0_steps\n10000,90.5,0.5,1.5\n20000,190.5,0.5,6\n"
            "30000,290.5,0.5,6\n");
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
}

TEST(ReadRecord, OfBeforeThereWereRevisionsIsOfTheFirst) {
  TestFolder dir;
  WriteFileAtomically(dir / "a.json",
                      R"({"status": "done", "steps": 7, "cpu_seconds": 1.5, "config": ""})");
  EXPECT_EQ(ReadRecord(dir / "a.json").revision, 1);
  EXPECT_EQ(ReadRecord(dir / "a.json").cpu_seconds, 1.5);
  Manifest manifest;
  manifest.revision = 2;
  WriteFileAtomically(dir / "b.json", RecordJson(ManifestJson(manifest), ""));
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
