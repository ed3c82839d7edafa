#include "report/replay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "base/check.h"
#include "env/task_helpers.h"
#include "test_folder.h"

namespace o2v {
namespace {

std::filesystem::path Trajectory() {
  return std::filesystem::path(O2V_TEST_DATA) / "trajectories" / "gym_hopper.csv";
}

std::string ConfigErrorOf(const std::string& task, const CsvTable& table) {
  try {
    Replay(*MakeEnv(task, EnvOptions{}), table);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(Replay, FollowsAWholeFileAndWritesItsColumns) {
  const TestFolder folder;
  const std::filesystem::path out = folder / "out.csv";
  EXPECT_LT(ReplayFile("Hopper-v2", Trajectory(), out).value, 1e-9);
  const CsvTable written = ReadCsv(out), reference = ReadCsv(Trajectory());
  EXPECT_EQ(written.columns, reference.columns);
  EXPECT_EQ(written.Rows(), reference.Rows());
  EXPECT_LT(LargestDeviation(written, reference).value, 1e-9);
}

TEST(Replay, FindsAWrongNumberAndSaysWhere) {
  CsvTable reference = ReadCsv(Trajectory());
  const CsvTable ours = Replay(*MakeEnv("Hopper-v2", EnvOptions{}), reference);
  const std::size_t column = reference.Column("qvel2");
  reference.values[7 * reference.columns.size() + column] += 0.5;
  const Deviation d = LargestDeviation(ours, reference);
  EXPECT_EQ(d.row, 7u);
  EXPECT_EQ(d.column, "qvel2");
  EXPECT_GT(d.value, 0.1);
  EXPECT_LT(LargestDeviation(ours, reference, /*rows=*/7).value, 1e-9);
}

TEST(Replay, ARowWithStepZeroIsInjected) {
  // The file twice, one after the other: the second roll is as the first.
  CsvTable twice = ReadCsv(Trajectory());
  const std::vector<double> once = twice.values;
  twice.values.insert(twice.values.end(), once.begin(), once.end());
  const CsvTable ours = Replay(*MakeEnv("Hopper-v2", EnvOptions{}), twice);
  const std::vector<double> first(ours.values.begin(), ours.values.begin() + long(once.size()));
  const std::vector<double> second(ours.values.begin() + long(once.size()), ours.values.end());
  EXPECT_EQ(first, second);
}

TEST(Replay, RowsBeyondTheFirstOnesOfEachSegmentAreLeftOut) {
  const CsvTable reference{"r", {"step", "x"}, {0, 1, 1, 1, 2, 1, 0, 1, 1, 1}};
  CsvTable ours = reference;
  ours.values[5] = 9;  // third row of the first segment
  EXPECT_EQ(LargestDeviation(ours, reference, 2).value, 0);
  EXPECT_EQ(LargestDeviation(ours, reference, 3).value, 8);
  ours.values[9] = 10;  // second row of the second segment
  EXPECT_EQ(LargestDeviation(ours, reference, 2).value, 9);
}

TEST(Replay, ANonFiniteNumberDeviatesInfinitely) {
  const CsvTable reference{"r", {"step", "x"}, {0, 1}};
  CsvTable ours = reference;
  ours.values[1] = std::nan("");
  EXPECT_TRUE(std::isinf(LargestDeviation(ours, reference).value));
}

TEST(Replay, RefusesTheTrajectoryOfAnotherModel) {
  const std::string message = ConfigErrorOf("HalfCheetah-v2", ReadCsv(Trajectory()));
  EXPECT_NE(message.find("gym_hopper.csv:1: column 5: expected 'ctrl3' for HalfCheetah-v2, got "
                         "'qpos0'"),
            std::string::npos)
      << message;
}

TEST(Replay, RefusesMissingAndAdditionalColumns) {
  CsvTable shorter{"t.csv", {"step", "ctrl0", "qpos0", "qpos1", "qvel0"}, {0, 0, 0, 0, 0}};
  EXPECT_EQ(ConfigErrorOf("InvertedPendulum-v2", shorter),
            "t.csv:1: expected 6 columns for InvertedPendulum-v2 ('qvel1' is the first missing "
            "one), got 5");
  CsvTable longer{"t.csv",
                  {"step", "ctrl0", "qpos0", "qpos1", "qvel0", "qvel1", "speed"},
                  {0, 0, 0, 0, 0, 0, 0}};
  EXPECT_EQ(ConfigErrorOf("InvertedPendulum-v2", longer),
            "t.csv:1: expected 6 columns for InvertedPendulum-v2 ('qvel1' is the last), got 7");
}

TEST(Replay, PutsATargetWhereTheRowsWithStepZeroSay) {
  CsvTable table{
      "t.csv",
      {"step", "ctrl0", "ctrl1", "qpos0", "qpos1", "qvel0", "qvel1", "target0", "target1"},
      {0, 0, 0, 1, 2, 0, 0, 0.1, 0.2,  //
       1, 0, 0, 0, 0, 0, 0, 0.3, 0.4}};
  TaskUnderTest task("dm-reacher-hard");
  CsvTable ours = Replay(*task.env, table);
  EXPECT_EQ(task.env->Target()[0], 0.1);
  EXPECT_EQ(task.env->Target()[1], 0.2);
  EXPECT_EQ(ours.At(1, 7), 0.1) << "it does not move during an episode";
  EXPECT_EQ(ours.At(1, 8), 0.2);
  EXPECT_EQ(ours.At(1, 3), 1) << "at rest";
  for (std::string& column : table.columns) {
    if (column == "target1") column = "target2";
  }
  EXPECT_EQ(ConfigErrorOf("dm-reacher-hard", table),
            "t.csv:1: column 9: expected 'target1' for dm-reacher-hard, got 'target2'");
}

TEST(Replay, ComparesWhatTheTaskReturnsWhereTheTableHasIt) {
  const std::filesystem::path file =
      std::filesystem::path(O2V_TEST_DATA) / "env_steps" / "dm-reacher-easy.csv";
  const CsvTable reference = ReadCsv(file);
  ASSERT_EQ(reference.columns.back(), "target1");
  CsvTable blank = reference;  // what the task returns must come from the task
  const std::size_t reward = blank.Column("reward");
  for (std::size_t row = 0; row < blank.Rows(); ++row) {
    blank.values[row * blank.columns.size() + reward] = -1;
  }
  const CsvTable ours = Replay(*MakeEnv("dm-reacher-easy", EnvOptions{}), blank);
  EXPECT_LT(LargestDeviation(ours, reference).value, 1e-8);
  EXPECT_EQ(LargestDeviation(ours, blank).column, "reward");
}

TEST(Replay, ALastRowOfZerosIsOnlyAState) {
  const std::vector<std::string> columns = {"step",  "ctrl0", "qpos0",  "qpos1",
                                            "qvel0", "qvel1", "reward", "terminated",
                                            "obs0",  "obs1",  "obs2",   "obs3"};
  const CsvTable table{"t.csv", columns, {0, 0, 0, 0.1, 0, 0, 9, 9, 9, 9, 9, 9,  //
                                          1, 0, 0, 0,   0, 0, 0, 0, 0, 0, 0, 0}};
  CsvTable ours = Replay(*MakeEnv("InvertedPendulum-v2", EnvOptions{}), table);
  EXPECT_EQ(ours.At(0, 6), 1) << "reward of a step";
  EXPECT_EQ(ours.At(0, 7), 0) << "upright";
  EXPECT_EQ(ours.At(0, 9), ours.At(1, 3)) << "the angle observed is that of the next row";
  EXPECT_EQ(ours.At(1, 6), 0) << "left as it is";
  CsvTable rewarded = table;
  rewarded.values[12 + 6] = 9;
  ours = Replay(*MakeEnv("InvertedPendulum-v2", EnvOptions{}), rewarded);
  EXPECT_EQ(ours.At(1, 6), 1) << "a reward makes it a step, whose observation is not zero";
  EXPECT_NE(ours.At(1, 9), 0);
}

TEST(Replay, RefusesATargetForATaskWithoutOne) {
  CsvTable table{"t.csv", {"step", "ctrl0", "qpos0", "qpos1", "qvel0", "qvel1", "target0"}, {}};
  EXPECT_EQ(ConfigErrorOf("dm-cartpole-balance", table),
            "t.csv:1: expected 6 columns for dm-cartpole-balance ('qvel1' is the last), got 7");
}

TEST(Replay, RefusesStepsThatDoNotCountUp) {
  CsvTable table{"t.csv",
                 {"step", "ctrl0", "qpos0", "qpos1", "qvel0", "qvel1"},
                 {0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0}};
  EXPECT_EQ(ConfigErrorOf("InvertedPendulum-v2", table),
            "t.csv:3: column 'step': expected 0 or 1, got 2");
  table.values[0] = 1;
  EXPECT_EQ(ConfigErrorOf("InvertedPendulum-v2", table),
            "t.csv:2: column 'step': expected 0, got 1");
}

}  // namespace
}  // namespace o2v
