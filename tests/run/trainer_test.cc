#include "run/trainer.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <fcntl.h>

#include <cerrno>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>
#include <tuple>

#include "base/csv.h"
#include "fake_run.h"
#include "run/checkpoint.h"
#include "run/record.h"

namespace {
int lock_error = 0;  // with which the next flock fails
}

// The program's own calls, in front of the system's.
extern "C" int flock(int fd, int operation) {
  if (lock_error != 0) {
    errno = lock_error;
    lock_error = lock_error == EINTR ? 0 : lock_error;
    return -1;
  }
  return int(syscall(SYS_flock, fd, operation));
}

namespace o2v {
namespace {

namespace fs = std::filesystem;

/// Thrown out of the middle of a run: what is on the disk then is what a kill would leave.
struct Interrupt {};

class Trainer : public testing::Test {
 protected:
  RunStatus Start(const std::string& name, const RunHooks& hooks = {}) {
    return Train(config_, parts_, dir_ / name, /*resume=*/false, progress_, /*terminal=*/false,
                 hooks);
  }
  RunStatus Resume(const std::string& name) {
    return Train(config_, parts_, dir_ / name, /*resume=*/true, progress_, /*terminal=*/false);
  }
  /// The message with which a folder is refused.
  template <typename Action>
  std::string Refused(Action&& action) {
    try {
      action();
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "accepted";
  }
  void ExpectSameFiles(const std::string& a, const std::string& b) {
    for (const std::string& file : kPromised) {
      EXPECT_TRUE(ReadFile(dir_ / a / file) == ReadFile(dir_ / b / file)) << a << " " << file;
    }
    EXPECT_TRUE(ReadFile(dir_ / (a + ".csv")) == ReadFile(dir_ / (b + ".csv"))) << a;
  }

  TestFolder dir_;
  RunConfig config_ = FakeConfig();
  RunParts parts_ = FakeParts(config_);
  std::ostringstream progress_;
};

TEST_F(Trainer, RefusesToGoOnWithARunOfAnotherRevision) {
  RunHooks hooks;
  hooks.stop = [] { return true; };
  parts_.revision = 1;
  EXPECT_EQ(Start("run", hooks), RunStatus::kStopped);
  parts_.revision = 2;
  EXPECT_EQ(Refused([&] { Resume("run"); }),
            (dir_ / "run").string() +
                ": this run was started by revision 1 of the method; this program has revision 2");
  EXPECT_EQ(ReadManifest(dir_ / "run")->revision, 1);
  parts_.revision = 1;
  EXPECT_EQ(Resume("run"), RunStatus::kDone);
}

TEST_F(Trainer, LeavesAWholeFolderAndItsRecord) {
  EXPECT_EQ(Start("run"), RunStatus::kDone);
  for (const std::string& file : kPromised) EXPECT_TRUE(fs::exists(dir_ / "run" / file)) << file;
  const Manifest manifest = ReadManifest(dir_ / "run").value();
  EXPECT_EQ(manifest.status, RunStatus::kDone);
  EXPECT_EQ(manifest.steps, 200);
  EXPECT_GT(manifest.wall_seconds, 0);
  EXPECT_EQ(ReadFile(dir_ / "run" / "config.toml"), ToToml(config_));
  EXPECT_TRUE(ReadFile(dir_ / "run.csv").starts_with("step,return_20\n200,"));
  EXPECT_TRUE(fs::exists(dir_ / "run.json"));
  // 20 iterations of 5 x 2 steps are less than a row; two evaluations at 50, 100, 150 and 200.
  EXPECT_TRUE(ReadFile(dir_ / "run" / "updates.csv").starts_with("step,reward,nudge\n200,"));
  const std::string evals = ReadFile(dir_ / "run" / "evals.csv");
  EXPECT_EQ(std::count(evals.begin(), evals.end(), '\n'), 1 + 8);
}

TEST_F(Trainer, EndsAfterTheFirstRolloutThatReachesItsSteps) {
  config_.steps = 191;
  Start("run");
  EXPECT_EQ(ReadManifest(dir_ / "run")->steps, 200);
}

TEST_F(Trainer, ChecksPointsAtTheFirstBoundaryAfterEachMultipleAndAtTheEnd) {
  config_.checkpoint_every = 45;
  std::vector<std::int64_t> steps;
  RunHooks hooks;
  hooks.before_rename = [&] {
    for (const auto& entry : fs::directory_iterator(dir_ / "run")) {
      if (!IsTemporary(entry.path())) continue;
      steps.push_back(std::stoll(ReadMetadata(entry.path()).at("total_steps")));
    }
  };
  Start("run", hooks);
  EXPECT_EQ(steps, (std::vector<std::int64_t>{50, 90, 140, 180, 200}));
}

TEST_F(Trainer, GivesTheSameBytesForTheSameSeed) {
  Start("a");
  Start("b");
  ExpectSameFiles("a", "b");
  config_.seed = 4;
  parts_ = FakeParts(config_);
  Start("c");
  EXPECT_FALSE(ReadFile(dir_ / "a" / "episodes.csv") == ReadFile(dir_ / "c" / "episodes.csv"));
}

TEST_F(Trainer, EvaluationsDoNotChangeTraining) {
  Start("with");
  config_.eval_every = 0;
  Start("without");
  EXPECT_FALSE(fs::exists(dir_ / "without" / "evals.csv"));
  for (const char* file : {"episodes.csv", "updates.csv"}) {
    EXPECT_TRUE(ReadFile(dir_ / "with" / file) == ReadFile(dir_ / "without" / file)) << file;
  }
}

TEST_F(Trainer, FlushesItsLogsBeforeACheckpoint) {
  config_.eval_every = 10;
  int checkpoints = 0;
  RunHooks hooks;
  hooks.before_checkpoint = [&] {
    const std::string evals = ReadFile(dir_ / "run" / "evals.csv");  // two after every iteration
    ++checkpoints;
    EXPECT_EQ(std::count(evals.begin(), evals.end(), '\n'), 1 + 2 * std::min(3 * checkpoints, 20));
  };
  Start("run", hooks);
  EXPECT_EQ(checkpoints, 7);
}

TEST_F(Trainer, PutsSmallUpdatesIntoRows) {
  config_.steps = 5000;
  Start("run");
  const CsvTable updates = ReadUpdates(dir_ / "run" / "updates.csv");
  ASSERT_EQ(updates.Rows(), 3u);
  for (std::size_t row = 0; row < 3; ++row) {  // 205 updates, 205 more, and the rest
    EXPECT_EQ(updates.At(row, 0), std::min(2050.0 * double(row + 1), 5000.0));
  }
}

TEST_F(Trainer, GoesOnFromAnInterruptionAnywhere) {
  config_.steps = 5000;  // rows of updates.csv at 2050, 4100 and 5000
  config_.checkpoint_every = 750;
  Start("whole");
  for (int moment = 0; moment < 3; ++moment) {
    for (int n = 1; n <= 7; ++n) {  // 7 checkpoints: after 750, 1500, ..., 4500 and 5000 steps
      const std::string name = std::to_string(moment) + "-" + std::to_string(n);
      int count = 0;
      const auto interrupt = [&] {
        if (++count == (moment == 2 ? 70 * n : n)) throw Interrupt();
      };
      RunHooks hooks;
      RunParts parts = parts_;
      if (moment == 0) hooks.before_checkpoint = interrupt;
      if (moment == 1) hooks.before_rename = interrupt;
      if (moment == 2) {
        parts.make_algorithm = [&](const EnvSpec& spec) {
          auto algorithm = std::make_unique<FakeAlgorithm>(spec, config_.seed);
          algorithm->in_update = interrupt;
          return algorithm;
        };
      }
      EXPECT_THROW(Train(config_, parts, dir_ / name, false, progress_, false, hooks), Interrupt);
      EXPECT_EQ(ReadManifest(dir_ / name)->status, RunStatus::kRunning);
      EXPECT_EQ(Resume(name), RunStatus::kDone);
      ExpectSameFiles(name, "whole");
    }
  }
}

TEST_F(Trainer, GoesOnWhenOnlyTheManifestIsMissing) {
  Start("whole");
  fs::copy(dir_ / "whole", dir_ / "run", fs::copy_options::recursive);
  fs::remove(dir_ / "run" / "manifest.json");
  EXPECT_EQ(Resume("run"), RunStatus::kDone);
  ExpectSameFiles("run", "whole");
}

TEST_F(Trainer, StopsWhenAskedAndGoesOn) {
  Start("whole");
  RunHooks hooks;
  int asked = 0;
  hooks.stop = [&] { return ++asked == 4; };
  EXPECT_EQ(Start("run", hooks), RunStatus::kStopped);
  EXPECT_EQ(ReadManifest(dir_ / "run")->status, RunStatus::kStopped);
  EXPECT_EQ(ReadManifest(dir_ / "run")->steps, 40);
  EXPECT_FALSE(fs::exists(dir_ / "run.csv"));
  EXPECT_EQ(Resume("run"), RunStatus::kDone);
  ExpectSameFiles("run", "whole");
}

TEST_F(Trainer, ResumeStartsAFolderThatDoesNotExistYet) {
  EXPECT_EQ(Resume("new"), RunStatus::kDone);
}

TEST_F(Trainer, RefusesAFinishedFolderUnlessToldToGoOn) {
  Start("run");
  EXPECT_EQ(Refused([&] { Start("run"); }), (dir_ / "run").string() + ": this run is done");
}

TEST_F(Trainer, LeavesAFinishedRunAsItIs) {
  Start("run");
  const std::string manifest = ReadFile(dir_ / "run" / "manifest.json");
  for (const char* name : {"run", "run/", "run/."}) {
    progress_.str("");
    EXPECT_EQ(Resume(name), RunStatus::kDone);
    EXPECT_EQ(progress_.str(), (dir_ / "run").string() + ": this run is already done\n");
    EXPECT_EQ(ReadFile(dir_ / "run" / "manifest.json"), manifest);
  }
  config_.steps = 300;
  EXPECT_TRUE(Refused([&] { Resume("run"); }).ends_with("'steps = 200', not 'steps = 300'"));
}

TEST_F(Trainer, LeavesARunAsItIsThatOnlyItsRecordSaysIsFinished) {
  Start("run");
  fs::remove_all(dir_ / "run");
  EXPECT_EQ(Resume("run"), RunStatus::kDone);
  EXPECT_FALSE(fs::exists(dir_ / "run"));
  config_.steps = 300;
  EXPECT_TRUE(Refused([&] { Resume("run"); }).starts_with((dir_ / "run.json").string() + ":"));
  EXPECT_FALSE(fs::exists(dir_ / "run"));
}

TEST_F(Trainer, WritesTheRecordThatAKilledProcessDidNot) {
  Start("run");
  const std::string csv = ReadFile(dir_ / "run.csv"), json = ReadFile(dir_ / "run.json");
  for (const char* lost : {"run.csv", "run.json"}) {
    fs::remove(dir_ / lost);
    EXPECT_EQ(Resume("run"), RunStatus::kDone);
    EXPECT_EQ(ReadFile(dir_ / "run.csv"), csv) << lost;
    EXPECT_EQ(ReadFile(dir_ / "run.json"), json) << lost;
  }
}

TEST_F(Trainer, LeavesSomebodysFilesBesideTheFolderAlone) {
  for (const char* name : {"run.csv", "run.json"}) {
    WriteFileAtomically(dir_ / name, "mine");
    EXPECT_EQ(
        Refused([&] { Start("run"); }),
        (dir_ / name).string() + ": the record of this run goes here; move this file away first");
    EXPECT_EQ(ReadFile(dir_ / name), "mine");
    EXPECT_FALSE(fs::exists(dir_ / "run"));
    fs::remove(dir_ / name);
  }
  fs::create_symlink("nowhere", dir_ / "run.csv");
  EXPECT_NE(Refused([&] { Start("run"); }), "accepted");
  fs::remove(dir_ / "run.csv");
  // They may come while the run is stopped.
  RunHooks hooks;
  hooks.stop = [] { return true; };
  Start("run", hooks);
  for (const char* name : {"run.csv", "run.json"}) {
    WriteFileAtomically(dir_ / name, "mine");
    EXPECT_NE(Refused([&] { Resume("run"); }), "accepted") << name;
    EXPECT_EQ(ReadFile(dir_ / name), "mine");
    fs::remove(dir_ / name);
  }
  // What a process left that was killed while it wrote the record is replaced.
  WriteFileAtomically(dir_ / "run.csv", "step,return_20\n");
  EXPECT_EQ(Resume("run"), RunStatus::kDone);
}

TEST_F(Trainer, RefusesNamesThatItsRecordHasNoRoomFor) {
  const std::string fits(237, 'n');  // + ".json.01234567.tmp" is 255
  EXPECT_EQ(Start(fits), RunStatus::kDone);
  EXPECT_TRUE(fs::exists(dir_ / (fits + ".json")));
  EXPECT_EQ(Refused([&] { Start(fits + "n"); }),
            (dir_ / (fits + "n")).string() +
                ": the name of its record would have 256 bytes, more than 255");
  EXPECT_FALSE(fs::exists(dir_ / (fits + "n")));
}

TEST_F(Trainer, RemovesWhatAKilledProcessLeftInItsFolderAndNothingElse) {
  fs::create_directory(dir_ / "run");
  AppendToFile(dir_ / "run" / "config.toml.0123abcd.tmp", "[run]");
  RunHooks hooks;
  hooks.stop = [] { return true; };
  Start("run", hooks);
  AppendToFile(dir_ / "run" / "last.ckpt.89ef4567.tmp", "half of it");
  AppendToFile(dir_ / "run" / "notes.tmp", "mine");
  EXPECT_EQ(Resume("run"), RunStatus::kDone);
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(dir_ / "run")) {
    names.insert(entry.path().filename());
  }
  EXPECT_EQ(names,
            (std::set<std::string>{"config.toml", "episodes.csv", "evals.csv", "last.ckpt",
                                   "manifest.json", "notes.tmp", "timing.csv", "updates.csv"}));
}

TEST_F(Trainer, SaysWhyAFolderCannotBeLocked) {
  fs::create_directory(dir_ / "run");
  lock_error = ENOLCK;
  EXPECT_EQ(Refused([&] { Start("run"); }),
            (dir_ / "run").string() + ": cannot be locked for this process: No locks available");
  lock_error = EINTR;
  EXPECT_EQ(Start("run"), RunStatus::kDone);
}

TEST_F(Trainer, CutsATornRowOfItsTimes) {
  RunHooks hooks;
  hooks.stop = [] { return true; };
  Start("run", hooks);
  const std::string whole = ReadFile(dir_ / "run" / "timing.csv");
  AppendToFile(dir_ / "run" / "timing.csv", "20,0.");  // a full disk
  Resume("run");
  const CsvTable times = ReadCsv(dir_ / "run" / "timing.csv");
  ASSERT_EQ(times.Rows(), 20u);
  EXPECT_TRUE(ReadFile(dir_ / "run" / "timing.csv").starts_with(whole));
  for (std::size_t row = 0; row < 20; ++row) EXPECT_EQ(times.At(row, 0), 10.0 * double(row + 1));
}

TEST_F(Trainer, NamesWindowsLineEndsOfAConfig) {
  RunHooks hooks;
  hooks.stop = [] { return true; };
  Start("run", hooks);
  std::string text = ReadFile(dir_ / "run" / "config.toml");
  for (std::size_t i = 0; (i = text.find('\n', i)) != std::string::npos; i += 2) {
    text.replace(i, 1, "\r\n");
  }
  WriteFileAtomically(dir_ / "run" / "config.toml", text);
  EXPECT_TRUE(Refused([&] { Resume("run"); }).find("config.toml:1: ends in CR LF") !=
              std::string::npos);
}

TEST_F(Trainer, StopsInTheMiddleOfAnEvaluationAndGoesOn) {
  Start("whole");
  // QueryCache after each of four iterations; then before each step of the evaluation after the
  // fifth, of two episodes of at most 7 steps.
  for (int moment = 5; moment <= 8; ++moment) {
    const std::string name = std::to_string(moment);
    int asked = 0;
    RunHooks hooks;
    hooks.stop = [&] { return ++asked >= moment; };
    EXPECT_EQ(Start(name, hooks), RunStatus::kStopped);
    EXPECT_EQ(asked, moment) << "it went on";
    EXPECT_EQ(ReadManifest(dir_ / name)->status, RunStatus::kStopped);
    EXPECT_EQ(ReadMetadata(dir_ / name / "last.ckpt").at("total_steps"), "30");
    EXPECT_EQ(Resume(name), RunStatus::kDone);
    ExpectSameFiles(name, "whole");
  }
}

TEST_F(Trainer, RefusesAnUnfinishedFolderUnlessToldToGoOn) {
  RunHooks hooks;
  hooks.stop = [] { return true; };
  Start("run", hooks);
  EXPECT_EQ(Refused([&] { Start("run"); }),
            (dir_ / "run").string() + ": contains an unfinished run; use --resume to continue");
}

TEST_F(Trainer, NamesTheLineInWhichTheConfigDiffers) {
  RunHooks hooks;
  hooks.stop = [] { return true; };
  Start("run", hooks);
  config_.steps = 300;
  const std::string text = ToToml(config_), before = text.substr(0, text.find("steps = 300"));
  EXPECT_EQ(Refused([&] { Resume("run"); }),
            Concat((dir_ / "run" / "config.toml").string(), ":",
                   1 + std::count(before.begin(), before.end(), '\n'),
                   ": this run was started with 'steps = 200', not 'steps = 300'"));
}

TEST_F(Trainer, NamesALineThatWasAddedToTheConfigOrIsGone) {
  RunHooks hooks;
  hooks.stop = [] { return true; };
  Start("run", hooks);
  const fs::path path = dir_ / "run" / "config.toml";
  const std::string text = ReadFile(path);
  const auto lines = std::count(text.begin(), text.end(), '\n');
  AppendToFile(path, "# mine\n");
  EXPECT_EQ(Refused([&] { Resume("run"); }),
            Concat(path.string(), ":", lines + 1,
                   ": this run was started with '# mine', not '(nothing)'"));
  const std::size_t last = text.rfind('\n', text.size() - 2) + 1;
  WriteFileAtomically(path, text.substr(0, last));
  EXPECT_EQ(Refused([&] { Resume("run"); }),
            Concat(path.string(), ":", lines, ": this run was started with '(nothing)', not '",
                   text.substr(last, text.size() - last - 1), "'"));
}

TEST_F(Trainer, RefusesAFolderOfOtherThings) {
  fs::create_directory(dir_ / "run");
  WriteFileAtomically(dir_ / "run" / "thesis.tex", "");
  EXPECT_EQ(Refused([&] { Resume("run"); }),
            (dir_ / "run").string() +
                ": contains thesis.tex but no config.toml: not the folder of a run");
}

TEST_F(Trainer, RefusesAFolderThatIsBeingTrainedIn) {
  fs::create_directory(dir_ / "run");
  const int fd = ::open((dir_ / "run").c_str(), O_RDONLY);
  ASSERT_EQ(::flock(fd, LOCK_EX), 0);
  EXPECT_EQ(Refused([&] { Start("run"); }),
            (dir_ / "run").string() + ": another process is training in this folder");
  ::close(fd);
  EXPECT_EQ(Start("run"), RunStatus::kDone);
}

TEST_F(Trainer, LeavesNoFolderBehindWhenTheMethodCannotBeMade) {
  parts_.make_algorithm = [](const EnvSpec&) -> std::unique_ptr<Algorithm> {
    throw ConfigError("x.toml:1: key 'x' is not used");
  };
  EXPECT_THROW(Start("run"), ConfigError);
  EXPECT_FALSE(fs::exists(dir_ / "run"));
}

TEST_F(Trainer, RefusesTheCheckpointOfAnotherRun) {
  RunHooks hooks;
  hooks.stop = [] { return true; };
  Start("run", hooks);
  config_.seed = 4;
  Start("other", hooks);
  fs::copy_file(dir_ / "run" / "last.ckpt", dir_ / "other" / "last.ckpt",
                fs::copy_options::overwrite_existing);
  EXPECT_THROW(Resume("other"), Error);
}

TEST_F(Trainer, KeepsWhatADivergedRunHas) {
  struct Diverging final : Env {
    explicit Diverging(int& left) : left(left) {}
    const EnvSpec& Spec() const override { return env.Spec(); }
    void Reset(Rng& rng, std::span<double> obs) override { env.Reset(rng, obs); }
    StepResult Step(std::span<const double> a, std::span<double> obs) override {
      if (--left == 0) throw DivergedError("bad qacc");
      return env.Step(a, obs);
    }
    void Serialize(StateVisitor& v, const std::string& prefix) override {
      env.Serialize(v, prefix);
    }
    int& left;
    FakeEnv env;
  };
  config_.eval_every = 0;
  int left = 99;  // in the tenth rollout, after three checkpoints
  parts_.make_env = [&left](int) { return std::make_unique<Diverging>(left); };
  EXPECT_THROW(Start("run"), DivergedError);
  EXPECT_EQ(ReadMetadata(dir_ / "run" / "last.ckpt").at("total_steps"), "90");
  const Manifest manifest = ReadManifest(dir_ / "run").value();
  EXPECT_EQ(manifest.status, RunStatus::kDiverged);
  EXPECT_EQ(manifest.steps, 98);
  EXPECT_TRUE(fs::exists(dir_ / "run.csv"));
  const CsvTable updates = ReadUpdates(dir_ / "run" / "updates.csv");
  ASSERT_EQ(updates.Rows(), 1u);  // of the nine updates before
  EXPECT_EQ(updates.At(0, 0), 90);
  EXPECT_EQ(Refused([&] { Start("run"); }), (dir_ / "run").string() + ": this run is diverged");
  try {
    Resume("run");
    ADD_FAILURE() << "it went on";
  } catch (const DivergedError& e) {
    EXPECT_EQ(e.what(), (dir_ / "run").string() + ": this run has diverged");
  }
  EXPECT_EQ(ReadManifest(dir_ / "run")->steps, 98);
}

/// Spoils what the update at `left` = 1 leaves behind.
class SpoiledAlgorithm final : public FakeAlgorithm {
 public:
  enum class What { kStatistic, kParameter };
  SpoiledAlgorithm(const EnvSpec& spec, std::uint64_t seed, What what, double value)
      : FakeAlgorithm(spec, seed), what_(what), value_(value) {}

  const std::vector<SumAndCount>& Update() override {
    stats_ = FakeAlgorithm::Update();
    if (--left_ == 0) {
      if (what_ == What::kStatistic) stats_[1].sum = value_;
      if (what_ == What::kParameter) Params()[1]->value(0) = static_cast<Real>(value_);
    }
    return stats_;
  }

 private:
  What what_;
  double value_;
  int left_ = 10;  // the update at step 100, after three checkpoints
  std::vector<SumAndCount> stats_;
};

TEST_F(Trainer, AnUpdateThatIsNotFiniteIsNeitherLoggedNorSaved) {
  config_.eval_every = 0;
  Start("healthy");
  const std::string all = ReadFile(dir_ / "healthy" / "episodes.csv");
  using What = SpoiledAlgorithm::What;
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  for (const auto& [what, value, name] : {std::tuple{What::kStatistic, nan, "nudge"},
                                          {What::kStatistic, -inf, "nudge"},
                                          {What::kParameter, nan, "actor.b"},
                                          {What::kParameter, inf, "actor.b"}}) {
    const std::string run = Concat(name, value);
    parts_.make_algorithm = [&, what = what, value = value](const EnvSpec& spec) {
      return std::make_unique<SpoiledAlgorithm>(spec, config_.seed, what, value);
    };
    try {
      Start(run);
      ADD_FAILURE() << run << " did not diverge";
    } catch (const DivergedError& e) {
      EXPECT_EQ(e.what(), Concat("Fake-v0: ", name, " is not finite after the update at step 100"));
    }
    EXPECT_EQ(ReadMetadata(dir_ / run / "last.ckpt").at("total_steps"), "90");
    const Manifest manifest = ReadManifest(dir_ / run).value();
    EXPECT_EQ(manifest.status, RunStatus::kDiverged);
    EXPECT_EQ(manifest.steps, 100);
    EXPECT_EQ(ReadRecordHead(dir_ / (run + ".json")).status, RunStatus::kDiverged);
    EXPECT_TRUE(fs::exists(dir_ / (run + ".csv")));
    const CsvTable updates = ReadUpdates(dir_ / run / "updates.csv");
    ASSERT_EQ(updates.Rows(), 1u);  // the nine healthy ones
    EXPECT_EQ(updates.At(0, 0), 90);
    // The episodes that ended in the first hundred steps, also in the rollout of the bad update.
    const std::string kept = ReadFile(dir_ / run / "episodes.csv");
    EXPECT_TRUE(all.starts_with(kept));
    const auto episodes = ReadEpisodes(dir_ / "healthy" / "episodes.csv");
    EXPECT_EQ(std::count(kept.begin(), kept.end(), '\n') - 1,
              std::count_if(episodes.begin(), episodes.end(),
                            [](const CurvePoint& episode) { return episode.first < 100; }));
  }
}

TEST_F(Trainer, RewardsAndObservationsThatOverflowDiverge) {
  // Finite numbers whose sums or squares are not.
  struct Huge final : Env {
    Huge(double reward, double observation) : reward(reward), observation(observation) {}
    const EnvSpec& Spec() const override { return env.Spec(); }
    void Reset(Rng& rng, std::span<double> obs) override { env.Reset(rng, obs); }
    StepResult Step(std::span<const double> a, std::span<double> obs) override {
      StepResult result = env.Step(a, obs);
      obs[0] += observation;
      return {result.reward + reward, false, result.truncated};
    }
    void Serialize(StateVisitor& v, const std::string& prefix) override {
      env.Serialize(v, prefix);
    }
    double reward, observation;
    FakeEnv env;
  };
  config_.eval_every = 0;
  for (const auto& [reward, observation, message] :
       {std::tuple{1e308, 0.0, "Fake-v0: the return of worker 0 is inf at step 2 of the episode"},
        {0.0, 1e200, "Fake-v0: normalizer.var is not finite after the update at step 10"}}) {
    parts_.make_env = [reward = reward, observation = observation](int) {
      return std::make_unique<Huge>(reward, observation);
    };
    const std::string run = Concat(reward);
    try {
      Start(run);
      ADD_FAILURE() << run << " did not diverge";
    } catch (const DivergedError& e) {
      EXPECT_STREQ(e.what(), message);
    }
    EXPECT_EQ(ReadRecordHead(dir_ / (run + ".json")).status, RunStatus::kDiverged);
  }
}

TEST_F(Trainer, ShowsOneLineOnATerminalAndPlainLinesElsewhere) {
  std::ostringstream terminal;
  Train(config_, parts_, dir_ / "a", false, terminal, true);
  const std::string shown = terminal.str();
  EXPECT_TRUE(shown.starts_with("\rstep 10/200  ")) << shown;
  EXPECT_EQ(std::count(shown.begin(), shown.end(), '\r'), 20);
  EXPECT_TRUE(shown.ends_with("left 0:00\x1b[K\n")) << shown;
  Start("b");
  EXPECT_EQ(progress_.str().find('\r'), std::string::npos);
  EXPECT_TRUE(progress_.str().ends_with("left 0:00\n")) << progress_.str();
}

}  // namespace
}  // namespace o2v
