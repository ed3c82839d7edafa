#include "report/summary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>

#include "base/check.h"
#include "base/files.h"
#include "run/config.h"
#include "run/record.h"
#include "test_folder.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;

class Summary : public testing::Test {
 protected:
  /// A record as a finished run leaves it; `curve` are rows "step,return".
  void Record(const std::string& task, int seed, std::int64_t wanted_steps,
              const std::string& curve, RunStatus status = RunStatus::kDone,
              std::int64_t steps = 2000000, int revision = 1) const {
    RunRequest request;
    request.task = task;
    request.algorithm = "ppo";
    request.steps = wanted_steps;
    request.seed = seed;
    Manifest manifest;
    manifest.status = status;
    manifest.steps = steps;
    manifest.revision = revision;
    const fs::path dir = root_ / "paper" / task / "ppo";
    const std::string name = "seed-00" + std::to_string(seed);
    fs::create_directories(dir);
    WriteFileAtomically(dir / (name + ".csv"), "step,return_20\n" + curve);
    WriteFileAtomically(dir / (name + ".json"),
                        RecordJson(ManifestJson(manifest), ToToml(ResolveRun(request))));
  }

  const TestFolder folder_;
  const fs::path root_ = folder_ / "results";
};

TEST_F(Summary, HasARowForTheEndOfEachTaskOfAPair) {
  Record("Cheetah", 0, 2000000, "1000000,1\n1010000,2\n2000000,3\n");
  const auto rows = Summarize(root_).rows;
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].step, 1000000);
  EXPECT_EQ(rows[0].values, (std::vector<double>{1}));
  EXPECT_EQ(rows[1].step, 2000000);
  EXPECT_EQ(rows[1].values, (std::vector<double>{3}));
}

TEST_F(Summary, TakesTheLastValueAtOrBeforeTheStep) {
  Record("Hopper-v2", 0, 30000, "10000,1\n20000,2\n30000,30\n");
  Record("Hopper-v2", 1, 30000, "10000,5\n20000,6\n29000,50\n30001,99\n");
  const auto rows = Summarize(root_).rows;
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].step, 30000);
  EXPECT_EQ(rows[0].values, (std::vector<double>{30, 50}));
  EXPECT_EQ(rows[0].fidelity, "paper");
  EXPECT_EQ(rows[0].task, "Hopper-v2");
  EXPECT_EQ(rows[0].algorithm, "ppo");
}

TEST_F(Summary, TakesNoValueFromAfterTheStep) {
  // The second's next value is one step too late, and so is the third's first.
  Record("Hopper-v2", 0, 25000, "10000,1\n20000,2\n25000,3\n");
  Record("Hopper-v2", 1, 25000, "20000,6\n25001,7\n40000,9\n");
  Record("Hopper-v2", 2, 25000, "25001,4\n50000,8\n");
  const auto rows = Summarize(root_).rows;
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].step, 25000);
  EXPECT_EQ(rows[0].values, (std::vector<double>{3, 6}));
  EXPECT_EQ(rows[0].n_short, 1);
}

TEST_F(Summary, LooksAtOneMillionStepsInLongerRuns) {
  Record("Hopper-v2", 0, 2000000, "990000,1\n1000000,2\n1010000,3\n");
  const auto rows = Summarize(root_).rows;
  EXPECT_EQ(rows[0].step, 1000000);
  EXPECT_EQ(rows[0].values, (std::vector<double>{2}));
}

TEST_F(Summary, CountsDivergedAndShortRunsApart) {
  Record("Hopper-v2", 0, 30000, "30000,4\n");
  Record("Hopper-v2", 1, 30000, "10000,7\n", RunStatus::kDiverged, 12000);
  Record("Hopper-v2", 2, 30000, "");
  const auto rows = Summarize(root_).rows;
  EXPECT_EQ(rows[0].values, (std::vector<double>{4}));
  EXPECT_EQ(rows[0].n_diverged, 1);
  EXPECT_EQ(rows[0].n_short, 1);
  EXPECT_NE(SummaryTable(rows).find("1 diverged, 1 short, 0 older"), std::string::npos);
}

TEST_F(Summary, ARunThatDivergesInItsLastUpdateHasItsReturn) {
  Record("Hopper-v2", 0, 30000, "30000,7\n", RunStatus::kDiverged, 30000);
  Record("Hopper-v2", 1, 30000, "20000,9\n", RunStatus::kDiverged, 29999);
  const auto rows = Summarize(root_).rows;
  EXPECT_EQ(rows[0].values, (std::vector<double>{7}));
  EXPECT_EQ(rows[0].n_diverged, 1);
}

TEST_F(Summary, AShortenedPairEndsItsFirstTaskAtHalfOfItsSteps) {
  Record("Cheetah", 0, 40000, "20000,1\n30000,2\n40000,3\n", RunStatus::kDone, 40000);
  const auto rows = Summarize(root_).rows;
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].step, 20000);
  EXPECT_EQ(rows[0].values, (std::vector<double>{1}));
  EXPECT_EQ(rows[1].step, 40000);
  EXPECT_EQ(rows[1].values, (std::vector<double>{3}));
}

TEST_F(Summary, LeavesOutRunsOfOlderRevisionsAndSaysSo) {
  // Revisions 1, 2, 1, 2: of the older two neither the returns nor the fewer steps count.
  Record("Hopper-v2", 0, 20000, "20000,100\n");
  Record("Hopper-v2", 1, 30000, "30000,4\n", RunStatus::kDone, 30000, 2);
  Record("Hopper-v2", 2, 30000, "10000,7\n", RunStatus::kDiverged, 12000);
  Record("Hopper-v2", 3, 30000, "30000,6\n", RunStatus::kDone, 30000, 2);
  Record("Ant-v2", 0, 30000, "30000,1\n");  // newest there is
  const auto rows = Summarize(root_).rows;
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].values, (std::vector<double>{1}));
  EXPECT_EQ(rows[0].n_older, 0);
  EXPECT_EQ(rows[1].step, 30000);
  EXPECT_EQ(rows[1].values, (std::vector<double>{4, 6}));
  EXPECT_EQ(rows[1].n_diverged, 0);
  EXPECT_EQ(rows[1].n_older, 2);
  EXPECT_NE(SummaryTable(rows).find("0 diverged, 0 short, 2 older"), std::string::npos);
}

TEST_F(Summary, ReadsRecordsWithEmptyCellsOfOptions) {
  Record("Hopper-v2", 0, 30000, "");
  const fs::path csv = root_ / "paper/Hopper-v2/ppo/seed-000.csv";
  const std::string header = "step,return_20,usage_0,duration_0_steps\n";
  WriteFileAtomically(csv, header + "10000,-1e-05,0,\n20000,2.5,1,12\n30000,3.5,0,\n");
  EXPECT_EQ(Summarize(root_).rows[0].values, (std::vector<double>{3.5}));
  for (const char* row : {"10000", "10000,", "10000,1", "10000,1,0", "10000,x,0,", "10000.5,1,0,",
                          "10000,1 ,0,", "10000,nan,0,", "10000,inf,0,", "10000,1,0,,"}) {
    WriteFileAtomically(csv, header + row + "\n");
    EXPECT_EQ(Summarize(root_).refused.size(), 1u) << row;
  }
  WriteFileAtomically(csv, "step,return_200\n10000,1\n");
  EXPECT_TRUE(Summarize(root_).rows.empty());
}

TEST_F(Summary, CsvHoldsTheStatisticsOfHandMadeRuns) {
  Record("Hopper-v2", 0, 30000, "30000,1\n");
  Record("Hopper-v2", 1, 30000, "30000,3\n");
  // mean 2, deviations -1 and 1: std 1, stderr 1 / sqrt 2; IQM: the halves next to the middle.
  // The bootstrap of two values spans them.
  EXPECT_EQ(SummaryCsv(Summarize(root_).rows),
            "fidelity,task,algorithm,step,n_seeds,mean,std,stderr,iqm,ci_low,ci_high\n"
            "paper,Hopper-v2,ppo,30000,2,2,1,0.707107,2,1,3\n");
}

TEST_F(Summary, TableHasTheAuthorsNumbersBesideOurs) {
  Record("HalfCheetah-v2", 0, 1000000, "1000000,3000\n");
  const std::string table = SummaryTable(Summarize(root_).rows);
  EXPECT_NE(table.find("3000 +- 0.000"), std::string::npos) << table;
  EXPECT_NE(table.find("2858 +- 695.5 (10)"), std::string::npos) << table;
}

TEST_F(Summary, OfAFolderWithoutRecordsIsEmpty) {
  EXPECT_TRUE(Summarize(root_).rows.empty());
  fs::create_directories(root_);
  EXPECT_TRUE(Summarize(root_).rows.empty());
}

TEST_F(Summary, RefusesADamagedRecordAlone) {
  Record("Hopper-v2", 0, 30000, "30000,1\n");
  Record("Hopper-v2", 1, 30000, "30000,3\n");
  const fs::path json = root_ / "paper/Hopper-v2/ppo/seed-000.json";
  const std::string text = ReadFile(json);
  WriteFileAtomically(json, text.substr(0, text.size() / 2));
  const ExperimentSummary summary = Summarize(root_);
  ASSERT_EQ(summary.rows.size(), 1u);
  EXPECT_EQ(summary.rows[0].values, (std::vector<double>{3}));
  ASSERT_EQ(summary.refused.size(), 1u);
  EXPECT_TRUE(summary.refused[0].starts_with(json.string() + ": ")) << summary.refused[0];
}

TEST_F(Summary, OfSeveralConfigurationsTheMostFrequentCountsElseTheFirst) {
  const auto steps = [&] {
    const ExperimentSummary summary = Summarize(root_);
    return std::pair(summary.rows.at(0).step, summary.refused.size());
  };
  Record("Hopper-v2", 0, 20000, "20000,1\n");
  Record("Hopper-v2", 1, 30000, "30000,3\n");
  EXPECT_EQ(steps(), std::pair(std::int64_t{20000}, std::size_t{1}));
  Record("Hopper-v2", 2, 30000, "30000,3\n");
  EXPECT_EQ(steps(), std::pair(std::int64_t{30000}, std::size_t{1}));
}

TEST(Verdicts, OfTheRecordsKeptForTheTestsAreThoseOfTheirList) {
  const fs::path root = fs::path(O2V_TEST_DATA) / "records";
  std::istringstream list(ReadFile(root / "verdicts.csv"));
  std::map<std::string, std::map<std::string, std::string>> wanted;  // experiment, file: reason
  std::map<std::string, int> good;
  std::string line;
  for (std::getline(list, line); std::getline(list, line);) {
    const std::string file = line.substr(0, line.find(','));
    const std::string reason = line.substr(file.size() + 1), name = file.substr(0, file.find('/'));
    if (reason.empty()) {
      ++good[name];
    } else {
      wanted[name][(root / file).string()] = reason;
    }
  }
  ASSERT_EQ(wanted.size(), 2u);
  for (auto& [name, refused] : wanted) {
    const ExperimentSummary summary = Summarize(root / name);
    std::size_t count = 0;
    for (const SummaryRow& row : summary.rows) {
      if (row.task != "Cheetah" || row.step == 1000000) count += row.values.size();
    }
    EXPECT_EQ(count, good[name]) << name;
    EXPECT_EQ(summary.refused.size(), refused.size()) << name;
    for (const std::string& message : summary.refused) {
      const std::string file = message.substr(0, message.find(".json") + 5);
      EXPECT_TRUE(refused.contains(file)) << message;
      EXPECT_NE(message.find(refused[file], file.size() - std::string("seed-000.json").size()),
                std::string::npos)
          << message;
    }
  }
}

TEST(Verdicts, DoNotDependOnHowAFolderIsWritten) {
  const fs::path root = fs::path(O2V_TEST_DATA) / "records";
  const auto refused = Summarize(root / "single_task").refused.size();
  for (const fs::path& folder :
       {root / "single_task/", root / "mine/../single_task", root / "single_task/."}) {
    EXPECT_EQ(Summarize(folder).refused.size(), refused) << folder;
  }
}

TEST(FormatOne, RecordsOfEveryMethodStayReadable) {
  const ExperimentSummary summary = Summarize(fs::path(O2V_TEST_DATA) / "records" / "format-1");
  EXPECT_TRUE(summary.refused.empty()) << summary.refused[0];
  std::map<std::string, double> returns;  // by method; last cells of the files
  for (const SummaryRow& row : summary.rows) {
    if (row.task == "HalfCheetah-v2") returns[row.algorithm] = row.values.at(0);
  }
  for (const AlgorithmEntry& info : AlgorithmRegistry()) {
    EXPECT_TRUE(returns.contains(info.id)) << info.id;
  }
  EXPECT_NEAR(returns.at("ppo"), 1660.4229953144957, 1e-9);
}

TEST(PublishedReturn, IsReturnAt1MFromOneMillionStepsOn) {
  // Table of results/reference/README.md.
  const auto cheetah = PublishedReturn("HalfCheetah-v2", "option2vec", 1000000);
  ASSERT_TRUE(cheetah);
  EXPECT_NEAR(cheetah->mean, 3461, 0.5);
  EXPECT_NEAR(cheetah->std, 209, 0.5);
  EXPECT_EQ(cheetah->n, 10);
  const auto ant = PublishedReturn("Ant-v2", "option2vec", 1500000);
  ASSERT_TRUE(ant);
  EXPECT_NEAR(ant->mean, 904, 0.5);
  EXPECT_EQ(ant->n, 9);
}

TEST(PublishedReturn, IsLinearBetweenGridPointsBeforeThat) {
  const auto low = PublishedReturn("Hopper-v2", "ppo", 200000);
  const auto middle = PublishedReturn("Hopper-v2", "ppo", 205000);
  const auto high = PublishedReturn("Hopper-v2", "ppo", 220000);
  ASSERT_TRUE(low && middle && high);
  EXPECT_NE(low->mean, high->mean);
  EXPECT_DOUBLE_EQ(middle->mean, low->mean + (high->mean - low->mean) / 4);
  EXPECT_DOUBLE_EQ(middle->std, low->std + (high->std - low->std) / 4);
}

TEST(PublishedReturn, OfAPairIsTheTasksEndsAndTheCurveElsewhere) {
  // Table of results/reference/README.md; the first task's end: mean of transfer_runs.csv.
  const auto end1 = PublishedReturn("Cheetah", "option2vec", 1000000),
             middle = PublishedReturn("Cheetah", "option2vec", 1500000),
             end2 = PublishedReturn("Cheetah", "option2vec", 2000000);
  ASSERT_TRUE(end1 && middle && end2);
  EXPECT_NEAR(end1->mean, 285.2, 0.05);
  EXPECT_NEAR(middle->mean, 80.0737, 1e-9);
  EXPECT_NEAR(end2->mean, 234.0, 0.05);
  EXPECT_NEAR(end2->std, 26.1, 0.05);
  EXPECT_EQ(end2->n, 10);
}

TEST(PublishedReturn, IsNothingForOtherTasksAndMethods) {
  EXPECT_FALSE(PublishedReturn("Nowhere-v2", "ppo", 1000000));
  EXPECT_FALSE(PublishedReturn("Nowhere-v2", "ppo", 10));
  EXPECT_FALSE(PublishedReturn("Hopper-v2", "sarsa", 1000000));
}

}  // namespace
}  // namespace o2v
