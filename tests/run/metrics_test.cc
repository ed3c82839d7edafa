#include "run/metrics.h"

#include <gtest/gtest.h>

#include "base/hash.h"
#include "fake_run.h"
#include "memory_visitor.h"

namespace o2v {
namespace {

/// Carries integers from one visited object to another.
class Carrier final : public StateVisitor {
 public:
  void Matrix(std::string_view, Mat&) override {}
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view, std::int64_t* x, std::size_t) override {
    if (reading_) {
      seen_.push_back(*x);
    } else {
      *x = seen_.at(next_++);
    }
  }
  void StartWriting() { reading_ = false, next_ = 0; }

 private:
  bool reading_ = true;
  std::vector<std::int64_t> seen_;
  std::size_t next_ = 0;
};

class Logs : public testing::Test {
 protected:
  /// One row, then the state for a checkpoint, then one more row.
  void SetUp() override {
    CsvLog log(path_, "step,x");
    log.Create();
    log.Row({"1", "0.5"});
    log.Flush();
    log.Serialize(checkpoint_, "log");
    log.Row({"2", "0.25"});
    log.Flush();
  }
  void Resume(const std::string& header = "step,x") {
    CsvLog log(path_, header);
    checkpoint_.StartWriting();
    log.Serialize(checkpoint_, "log");
    log.Resume();
    log.Row({"3", "7"});
    log.Flush();
  }

  TestFolder dir_;
  const std::filesystem::path path_ = dir_ / "log.csv";
  Carrier checkpoint_;
};

TEST_F(Logs, AreCutToTheCheckpointAndGoOn) {
  EXPECT_EQ(ReadFile(path_), "step,x\n1,0.5\n2,0.25\n");
  Resume();
  EXPECT_EQ(ReadFile(path_), "step,x\n1,0.5\n3,7\n");
}

TEST_F(Logs, ThatAreShorterThanTheCheckpointAreRefused) {
  WriteFileAtomically(path_, "step,x\n1,0.");
  EXPECT_THROW(Resume(), Error);
}

TEST_F(Logs, OfOtherColumnsAreRefusedAndLeftAlone) {
  const std::string before = ReadFile(path_);
  EXPECT_THROW(Resume("step,x,y"), Error);
  EXPECT_EQ(ReadFile(path_), before);
}

TEST_F(Logs, ThatHaveChangedAreRefusedAndLeftAlone) {
  const std::string changed = "step,x\n1,0.6\n2,0.25\n";
  WriteFileAtomically(path_, changed);
  EXPECT_THROW(Resume(), Error);
  EXPECT_EQ(ReadFile(path_), changed);
}

TEST(RunLogs, WriteTheirColumns) {
  TestFolder dir;
  RunLogs logs(dir / "", {"loss", "kl"}, /*evals=*/true);
  logs.Create();
  logs.AddEpisode({.step = 1000000,
                   .worker = 1,
                   .ret = -0.1,
                   .length = 7,
                   .terminated = true,
                   .truncated = false});
  logs.AddUpdate(2048, std::vector<SumAndCount>{{3, 2}, {1e-9, 1}});
  logs.AddEval(2048, 0, 3);
  logs.Flush();
  EXPECT_EQ(ReadFile(dir / "episodes.csv"),
            "step,worker,return,length,terminated,truncated\n1000000,1,-0.1,7,1,0\n");
  EXPECT_EQ(ReadFile(dir / "updates.csv"), "step,loss,kl\n2048,1.5,1e-09\n");
  EXPECT_EQ(ReadFile(dir / "evals.csv"), "step,episode,return\n2048,0,3\n");
}

TEST(CsvLog, ThatCannotBeBroughtToTheDiskIsAnErrorWithItsName) {
  CsvLog log("/dev/null", "step,x");  // takes every row, but has no disk
  log.Create();
  log.Row({"1", "0.5"});
  try {
    log.Flush();
    FAIL() << "flushed";
  } catch (const Error& e) {
    EXPECT_TRUE(std::string(e.what()).starts_with("/dev/null: ")) << e.what();
  }
}

/// updates.csv after the updates of this test, of which a checkpoint is taken after `seen`: those
/// after it are lost, and made again by another process. -1: none is.
std::string UpdatesOf(int seen) {
  TestFolder dir;
  const std::vector<std::string> columns = {"loss", "duration"};
  RunLogs first(dir / "", columns, /*evals=*/false), second(dir / "", columns, /*evals=*/false);
  RunLogs* logs = &first;
  MemoryVisitor checkpoint;
  const std::vector<std::pair<std::int64_t, std::vector<SumAndCount>>> updates = {
      {2048, {{6, 2}, {2048, 3}}},  // a row of its own
      {4095, {{1, 1}, {2, 0}}},     // 2047 steps: none yet
      {4100, {{9, 3}, {40, 1}}},    // 2052 steps: row of both
      {4105, {{5, 1}, {5, 0}}},
      {8000, {{3, 1}, {3, 0}}},  // no execution began: the steps themselves
      {8005, {{7, 1}, {5, 2}}}};
  logs->Create();
  for (int i = 0; i < int(updates.size()); ++i) {
    if (i == seen) {
      first.Flush();
      first.Serialize(checkpoint);
      first.AddUpdate(9999, std::vector<SumAndCount>{{-1, 1}, {-1, 1}});
      first.Flush();
      checkpoint.load = true;
      second.Serialize(checkpoint);
      second.Resume();
      logs = &second;
    }
    logs->AddUpdate(updates[std::size_t(i)].first, updates[std::size_t(i)].second);
  }
  logs->EndUpdates();
  logs->EndUpdates();  // nothing is left
  logs->Flush();
  return ReadFile(dir / "updates.csv");
}

TEST(RunLogs, PutSmallUpdatesTogether) {
  // Durations are steps by executions: 42 / 1, not the mean of 2 and 40.
  const std::string expected =
      "step,loss,duration\n2048,3,682.6666666666666\n4100,2.5,42\n8000,4,8\n8005,7,2.5\n";
  EXPECT_EQ(UpdatesOf(-1), expected);
  for (int seen = 0; seen < 6; ++seen) EXPECT_EQ(UpdatesOf(seen), expected) << seen;
}

TEST(RunLogs, RefuseAnUpdateOfOtherColumns) {
  TestFolder dir;
  RunLogs logs(dir / "", {"loss"}, /*evals=*/false);
  logs.Create();
  EXPECT_THROW(logs.AddUpdate(1, std::vector<SumAndCount>(2)), Error);
}

TEST(RunLogs, WriteNoEvaluationsWhenOff) {
  TestFolder dir;
  RunLogs logs(dir / "", {"loss"}, /*evals=*/false);
  logs.Create();
  EXPECT_FALSE(std::filesystem::exists(dir / "evals.csv"));
}

TEST(ReadEpisodes, ReadsWhatTheLogWrote) {
  TestFolder dir;
  RunLogs logs(dir / "", {"loss"}, /*evals=*/false);
  logs.Create();
  logs.Flush();
  EXPECT_TRUE(ReadEpisodes(dir / "episodes.csv").empty());
  logs.AddEpisode(
      {.step = 12, .worker = 0, .ret = 0.1, .length = 3, .terminated = false, .truncated = true});
  logs.Flush();
  EXPECT_EQ(ReadEpisodes(dir / "episodes.csv"), (std::vector<CurvePoint>{{12, 0.1}}));
}

TEST(SmoothedReturns, StandAtTheStepOfThe20thEpisode) {
  // Mean of 1..20 and of 2..21.
  EXPECT_EQ(SmoothedReturns(Rising(21)), (std::vector<CurvePoint>{{2000, 10.5}, {2100, 11.5}}));
  EXPECT_TRUE(SmoothedReturns(Rising(19)).empty());
}

}  // namespace
}  // namespace o2v
