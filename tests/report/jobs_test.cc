#include "report/jobs.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "base/check.h"
#include "base/files.h"
#include "env/pairs.h"
#include "run/record.h"
#include "test_folder.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;

class Jobs : public testing::Test {
 protected:
  JobQuery Query() const {
    JobQuery query;
    query.program = "./option2vec";
    query.configs = {"quick"};
    query.results = results_;
    return query;
  }
  /// Leaves behind what a run with this status does.
  void Leave(const Job& job, RunStatus status, int revision = 1, double cpu_seconds = 0,
             std::string config = "") const {
    if (config.empty()) config = ToToml(job.config);
    fs::create_directories(job.dir);
    WriteFileAtomically(job.dir / "config.toml", ToToml(job.config));
    Manifest manifest;
    manifest.status = status;
    manifest.steps = job.config.steps;
    WriteManifest(job.dir, manifest);
    if (status != RunStatus::kDone && status != RunStatus::kDiverged) return;
    manifest.revision = revision;
    manifest.cpu_seconds = cpu_seconds;
    WriteFileAtomically(RecordPath(job.dir, ".csv"), "step,return_20\n");
    WriteFileAtomically(RecordPath(job.dir, ".json"), RecordJson(ManifestJson(manifest), config));
  }

  const TestFolder folder_;
  const fs::path results_ = folder_ / "results";
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

TEST_F(Jobs, OfSeveralExperimentsTakeTheTasksThatAreTheirs) {
  JobQuery query = Query();
  query.configs = {"single_task", "transfer"};
  query.algorithms = {"ppo"};
  query.fidelities = {"paper"};
  query.seeds = {0};
  query.tasks = {"Ant-v2", "Fish"};
  const auto jobs = ListJobs(query);
  ASSERT_EQ(jobs.size(), 2u);
  EXPECT_EQ(jobs[0].dir, results_ / "single_task/paper/Ant-v2/ppo/seed-000");
  EXPECT_EQ(jobs[1].dir, results_ / "transfer/paper/Fish/ppo/seed-000");
  query.tasks = {"Ant-v2", "dm-fish-upright"};
  EXPECT_THROW(ListJobs(query), ConfigError);
}

TEST_F(Jobs, OfAnAblationTurnOneSwitchEach) {
  JobQuery query = Query();
  query.configs = {"ablation"};
  query.results = "results";
  query.tasks = {"Hopper-v2"};
  query.algorithms = {"option2vec"};
  query.seeds = {0};
  const auto jobs = ListJobs(query);
  // One switch of the first list, nine changes of the second, four numbers of options, and one
  // option with one worker; each in both fidelities. The list of PPO's changes is PPO's alone.
  ASSERT_EQ(jobs.size(), 2u * (1 + 9 + 4 + 1));
  EXPECT_EQ(
      jobs[0].command,
      "./option2vec train --config ablation --task Hopper-v2 --algo option2vec --fidelity paper "
      "--set timelimit=released --seed 0 --steps 1000000 --out "
      "results/ablation/paper-timelimit=released/Hopper-v2/option2vec/seed-000 --resume");
  const Job& other = jobs[11];  // the first of the second list in `released`
  EXPECT_EQ(other.dir,
            "results/ablation/released-o2v_option_in_update=paper/Hopper-v2/option2vec/seed-000");
  Switches one_turned = SwitchesFor(Fidelity::kReleased);
  one_turned.o2v_option_in_update = Fidelity::kPaper;
  EXPECT_EQ(other.config.switches.o2v_option_in_update, Fidelity::kPaper);
  for (const SwitchInfo& info : SwitchRegistry()) {
    if (!Concerns(info, other.config)) continue;
    EXPECT_EQ(SwitchValue(other.config.switches, info), SwitchValue(one_turned, info)) << info.name;
  }
}

TEST_F(Jobs, OfAnAblationChangeTheNumberOfOptions) {
  JobQuery query = Query();
  query.configs = {"ablation"};
  query.results = "results";
  std::map<std::string, int> runs;  // by folder of fidelity and change
  std::map<std::string, std::set<std::string>> tasks;
  std::set<std::filesystem::path> folders;
  for (const Job& job : ListJobs(query)) {
    EXPECT_TRUE(folders.insert(job.dir).second) << job.dir;  // none is there twice
    const auto task = job.dir.parent_path().parent_path();
    const std::string variant = task.parent_path().filename();
    if (variant.find("options=") == std::string::npos) continue;
    EXPECT_EQ(job.config.algorithm, "option2vec");
    EXPECT_EQ(variant.find(Concat("options=", job.config.hyper.Int("options", 1))),
              variant.find("options="));
    EXPECT_EQ(job.config.steps, SplitTasks(job.config.task).size() * 1'000'000);
    ++runs[variant];
    tasks[variant].insert(task.filename());
  }
  for (const char* fidelity : {"paper", "released"}) {
    for (const char* K : {"2", "8", "16"}) {
      EXPECT_EQ(runs[Concat(fidelity, "-options=", K)], 4 * 5) << K;  // tasks, seeds
    }
    EXPECT_EQ(runs[Concat(fidelity, "-options=1")], 4 * 5 + 12 * 3);
    EXPECT_EQ(tasks[Concat(fidelity, "-options=1")].size(), 10u + PairRegistry().size());
    EXPECT_EQ(runs[Concat(fidelity, "-options=1-workers=1")], 2 * 5);
  }
}

TEST_F(Jobs, OfAnAblationChangeSeveralThingsAtOnce) {
  JobQuery query = Query();
  query.configs = {"ablation"};
  query.results = "results";
  query.tasks = {"Hopper-v2"};
  query.algorithms = {"ppo"};
  query.fidelities = {"paper"};
  query.seeds = {4};
  const auto jobs = ListJobs(query);
  // PPO has no options: timelimit, density_log_eps is not its own; then activation and workers.
  ASSERT_EQ(jobs.size(), 1u + 3u);
  EXPECT_EQ(jobs[3].command,
            "./option2vec train --config ablation --task Hopper-v2 --algo ppo --fidelity paper "
            "--set activation=relu --set workers=4 --seed 4 --steps 1000000 --out "
            "results/ablation/paper-activation=relu-workers=4/Hopper-v2/ppo/seed-004 --resume");
  EXPECT_EQ(jobs[3].config.workers, 4);
  EXPECT_EQ(jobs[3].config.hyper.Real("activation"), 1);  // its place among tanh, relu
  EXPECT_EQ(jobs[1].config.workers, 1);
}

TEST_F(Jobs, ProgressIsWhatFinishedRunsOfTheKindTook) {
  JobQuery query = Query();  // 2 tasks, 2 methods, 2 seeds; pendulum 0.3M steps, cheetah 1M
  const auto before = ListJobs(query);
  EXPECT_EQ(ToString(MeasureProgress(before), 2),
            "8 runs: 0 done, 8 left, the time left is known after the first run");
  Leave(before[0], RunStatus::kDone, 1, 720);      // pendulum, ppo, seed 0
  Leave(before[1], RunStatus::kDiverged, 1, 1e9);  // pendulum, option2vec, seed 0
  const Progress some = MeasureProgress(ListJobs(query));
  EXPECT_EQ(some.finished, 2);
  EXPECT_EQ(some.timed, 1);
  EXPECT_EQ(some.kinds, 4);
  // Left: both of pendulum's second seed at 720 s, four of cheetah at 720 s * 1M / 0.3M.
  EXPECT_NEAR(some.cpu_seconds_left.value(), 2 * 720 + 4 * 2400, 1e-6);
  Leave(before[2], RunStatus::kDone, 1, 3600);  // cheetah, ppo, seed 0
  EXPECT_NEAR(MeasureProgress(ListJobs(query)).cpu_seconds_left.value(), 2 * 720 + 3 * 3600, 1e-6);
  EXPECT_EQ(
      ToString(MeasureProgress(ListJobs(query)), 2),
      "8 runs: 3 done (1 diverged), 5 left, about 3.4 CPU hours, 1.7 h with 2 at a time (2 of 4 "
      "kinds of runs measured, the rest estimated from these)");
  for (const Job& job : before) Leave(job, RunStatus::kDone, 1, 1);
  EXPECT_EQ(ToString(MeasureProgress(ListJobs(query)), 2), "8 runs: 8 done, 0 left");
}

TEST_F(Jobs, QuoteWordsForTheShell) {
  JobQuery query = Query();
  query.program = "/a b/it's";
  EXPECT_EQ(ListJobs(query)[0].command.substr(0, 20), "'/a b/it'\\''s' train");
  query.program = "~/it";  // a shell would put a home there
  EXPECT_EQ(ListJobs(query)[0].command.substr(0, 12), "'~/it' train");
}

TEST_F(Jobs, RefuseALineBreakInAName) {
  JobQuery query = Query();
  query.results = "a\nb";
  try {
    ListJobs(query);
    ADD_FAILURE();
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("contains a line break"), std::string::npos) << e.what();
  }
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
  Leave(ListJobs(Query())[2], RunStatus::kDone);
  const Progress progress = MeasureProgress(ListJobs(Query()));
  EXPECT_EQ(progress.finished, 2);
  EXPECT_EQ(progress.old, 1);
  EXPECT_TRUE(ToString(progress, 1)
                  .starts_with("8 runs: 2 done (1 by older revisions of their methods), 6 left"))
      << ToString(progress, 1);
}

TEST_F(Jobs, HalfARecordIsRefusedByName) {
  const Job job = ListJobs(Query())[0];
  Leave(job, RunStatus::kDone);
  const fs::path csv = RecordPath(job.dir, ".csv");
  fs::remove(csv);
  const Job half = ListJobs(Query())[0];
  EXPECT_FALSE(half.finished);
  EXPECT_TRUE(half.refused.starts_with(csv.string() + ": missing. A record is this file and"))
      << half.refused;
  // Of a run that was killed while it wrote its record, the .csv alone is there: it goes on.
  WriteFileAtomically(csv, "step,return_20\n");
  fs::remove(RecordPath(job.dir, ".json"));
  EXPECT_FALSE(ListJobs(Query())[0].finished);
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
  const auto jobs = ListJobs(Query());
  EXPECT_NE(jobs[0].refused.find("another configuration"), std::string::npos) << jobs[0].refused;
  EXPECT_FALSE(jobs[0].finished);
}

TEST_F(Jobs, ABadRecordIsRefusedAloneAndNeitherDoneNorLeft) {
  const auto before = ListJobs(Query());
  Leave(before[0], RunStatus::kDone, 1, 3600);
  Leave(before[2], RunStatus::kDone, 1, 3600);
  WriteFileAtomically(RecordPath(before[0].dir, ".json"), "{");
  fs::create_directories(before[3].dir);
  WriteFileAtomically(RecordPath(before[3].dir, ".csv"), "");
  fs::create_symlink("nowhere", RecordPath(before[3].dir, ".json"));
  const auto jobs = ListJobs(Query());
  for (const std::size_t bad : {0, 3}) {
    EXPECT_TRUE(jobs[bad].refused.starts_with(RecordPath(jobs[bad].dir, ".json").string()));
    EXPECT_FALSE(jobs[bad].finished);
  }
  EXPECT_EQ(jobs[2].finished, RunStatus::kDone);
  // Two of cheetah's 1M steps at 3600 s, three of pendulum's 0.3M: 10 440 s.
  EXPECT_TRUE(ToString(MeasureProgress(jobs), 1)
                  .starts_with("8 runs: 1 done, 2 with a refused record, 5 left, about 2.9 CPU"))
      << ToString(MeasureProgress(jobs), 1);
}

TEST_F(Jobs, ARecordOfBeforeASwitchWasAddedIsFinished) {
  JobQuery query = Query();
  const Job job = ListJobs(query)[0];
  std::string old = ToToml(job.config);
  old.erase(old.find("timelimit = \"paper\"\n"), std::string("timelimit = \"paper\"\n").size());
  Leave(job, RunStatus::kDone, 1, 0, old);
  EXPECT_FALSE(ListJobs(query)[0].finished);
  query.added = {{"switches", "timelimit", "paper", 2}};
  EXPECT_EQ(ListJobs(query)[0].finished, RunStatus::kDone);
  query.added[0].value = "released";  // then it was another run
  EXPECT_NE(ListJobs(query)[0].refused.find("another configuration"), std::string::npos);
}

TEST_F(Jobs, EveryExperimentOfTheProgramResolves) {
  for (const char* name : {"quick", "ci", "single_task", "transfer", "ablation"}) {
    JobQuery query = Query();
    query.configs = {name};
    EXPECT_FALSE(ListJobs(query).empty()) << name;
  }
}

TEST(ParseSeeds, ReadsNumbersAndRanges) {
  EXPECT_EQ(ParseSeeds("0-2,7"), (std::vector<std::uint64_t>{0, 1, 2, 7}));
  EXPECT_EQ(ParseSeeds("9223372036854775807").front(), 9223372036854775807u);
  EXPECT_EQ(ParseSeeds("007,010-011,1e2"), (std::vector<std::uint64_t>{7, 10, 11, 100}));
}

TEST(ParseSeeds, RefusesEverythingElse) {
  for (const char* text :
       {"", ",", "1,", "-1", "3-1", "1-", "a", "1 2", "0x1", "+1", "0-1-2", "1,,2", "1.5",
        "0-99999999", "9223372036854775808", "99999999999999999999"}) {
    EXPECT_THROW(ParseSeeds(text), ConfigError) << text;
  }
}

}  // namespace
}  // namespace o2v
