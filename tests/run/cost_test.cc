// What a run has cost, over all processes that worked on it.

#include <gtest/gtest.h>

#include <chrono>
#include <ctime>
#include <sstream>

#include "base/csv.h"
#include "fake_run.h"
#include "run/record.h"

namespace o2v {
namespace {

class Cost : public testing::Test {
 protected:
  /// Goes on for so many iterations, or to the end.
  void GoOn(int iterations = 1'000'000) {
    std::ostringstream progress;
    RunHooks hooks;
    hooks.stop = [&] { return --iterations == 0; };
    Train(config_, parts_, dir_ / "run", /*resume=*/true, progress, false, hooks);
  }
  Manifest Read() { return ReadManifest(dir_ / "run").value(); }
  /// As if the processes so far had taken this long.
  void Pretend(double wall, double cpu) {
    Manifest manifest = Read();
    manifest.wall_seconds = wall;
    manifest.cpu_seconds = cpu;
    manifest.start = "2020-01-02T03:04:05Z";
    WriteManifest(dir_ / "run", manifest);
  }
  /// Of this process, which is all that one resumed run can have taken.
  static double Wall() {
    using Seconds = std::chrono::duration<double>;
    return Seconds(std::chrono::steady_clock::now().time_since_epoch()).count();
  }
  static double Cpu() { return double(std::clock()) / CLOCKS_PER_SEC; }

  TestFolder dir_;
  RunConfig config_ = FakeConfig();  // 20 iterations, a checkpoint after every third
  RunParts parts_ = FakeParts(config_);
};

TEST_F(Cost, IsAddedUpOverTheProcessesOfARun) {
  GoOn(4);
  double wall = 3000, cpu = 1000;
  Pretend(wall, cpu);
  for (const int iterations : {4, 1'000'000}) {  // two more processes
    const double begin = Wall();
    GoOn(iterations);
    const Manifest manifest = Read();
    EXPECT_GT(manifest.wall_seconds, wall);
    EXPECT_LE(manifest.wall_seconds, wall + (Wall() - begin));
    EXPECT_GT(manifest.cpu_seconds, cpu);
    EXPECT_LE(manifest.cpu_seconds, cpu + Cpu());
    EXPECT_EQ(manifest.start, "2020-01-02T03:04:05Z");
    wall = manifest.wall_seconds;
    cpu = manifest.cpu_seconds;
  }
  EXPECT_EQ(Read().status, RunStatus::kDone);
  EXPECT_NEAR(ReadRecordHead(dir_ / "run.json").cpu_seconds, cpu, 1e-9);
}

TEST_F(Cost, OfAKilledProcessCountsToItsLastCheckpoint) {
  struct Interrupt {};
  RunHooks hooks;
  hooks.before_checkpoint = [&, n = 0]() mutable {
    if (++n == 2) throw Interrupt();  // at 60 steps; the manifest is of the checkpoint at 30
  };
  std::ostringstream progress;
  EXPECT_THROW(Train(config_, parts_, dir_ / "run", false, progress, false, hooks), Interrupt);
  EXPECT_EQ(Read().steps, 30);
  Pretend(3000, 1000);
  GoOn();
  EXPECT_GT(Read().wall_seconds, 3000);
  EXPECT_LT(Read().wall_seconds, 3000 + 3000);
  EXPECT_GT(Read().cpu_seconds, 1000);
}

TEST_F(Cost, IsInEveryRowOfTheTimingLogSinceTheStart) {
  GoOn(4);
  Pretend(3000, 1000);
  GoOn();
  // Columns step, wall_s, cpu_s, steps_per_s: a row an iteration.
  const CsvTable timing = ReadCsv(dir_ / "run" / "timing.csv");
  ASSERT_EQ(timing.Rows(), 20u);
  for (std::size_t row = 0; row < 20; ++row) {
    EXPECT_EQ(timing.At(row, timing.Column("step")), 10 * double(row + 1));
    const double wall = timing.At(row, timing.Column("wall_s"));
    const double cpu = timing.At(row, timing.Column("cpu_s"));
    EXPECT_EQ(wall >= 3000, row >= 4) << row;
    EXPECT_EQ(cpu >= 1000, row >= 4) << row;
    EXPECT_LE(wall, Read().wall_seconds * (1 + 1e-5)) << "six digits";
    EXPECT_LE(cpu, Read().cpu_seconds * (1 + 1e-5));
    EXPECT_GT(timing.At(row, timing.Column("steps_per_s")), 0);
  }
}

}  // namespace
}  // namespace o2v
