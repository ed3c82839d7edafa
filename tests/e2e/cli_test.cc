// The program from outside: exit codes, messages, files.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <tuple>

#include "base/csv.h"
#include "base/files.h"
#include "nn/isa.h"
#include "program.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;

bool OneLine(const std::string& text) {
  return !text.empty() && text.find('\n') == text.size() - 1;
}

/// The text after a line break, with one blank where there were several.
std::string Squeezed(const std::string& text) {
  std::string squeezed = "\n";
  for (const char c : text) {
    if (c != ' ' || squeezed.back() != ' ') squeezed += c;
  }
  return squeezed;
}

std::string WithoutSpaces(std::string text) {
  std::erase_if(text, [](char c) { return c == ' ' || c == '\n'; });
  return text;
}

TEST_F(Program, HelpWithExamplesSucceedsForEverySubcommand) {
  EXPECT_EQ(Run("--help").code, 0);
  for (const char* name :
       {"list", "train", "eval", "forward", "interpret", "params", "replay", "jobs", "summary"}) {
    const Outcome outcome = Run(std::string(name) + " --help");
    EXPECT_EQ(outcome.code, 0) << name;
    EXPECT_NE(outcome.out.find("Example"), std::string::npos) << name;
  }
}

TEST_F(Program, WrongUsageExitsWith2AndOneLine) {
  for (const char* arguments :
       {"", "fly", "train", "train --task Hopper-v2 --algo ppo", "list", "list shoes",
        "train --out r --seed x", "eval --checkpoint x --episodes 0", "interpret",
        "interpret x --delta 0", "params --frob"}) {
    const Outcome outcome = Run(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_PRED1(OneLine, outcome.err) << arguments;
  }
}

TEST_F(Program, ConfigErrorsExitWith2AndOneLine) {
  for (const char* arguments :
       {"train --task Hoper-v2 --algo ppo --out r", "train --task Hopper-v2 --algo pppo --out r",
        "train --task Hopper-v2 --algo ppo --out r --set gama=1",
        "train --task Hopper-v2 --algo ppo --out r --config absent.toml",
        "train --task Hopper-v2 --algo ppo --out r --seed -1", "jobs absent", "jobs run",
        "jobs quick --seeds a", "jobs quick --tasks Hoper-v2", "summary absent",
        "replay --task Hopper-v2 --trajectory absent.csv", "interpret absent", "interpret ."}) {
    const Outcome outcome = Run(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments << "\n" << outcome.err;
    EXPECT_PRED1(OneLine, outcome.err) << arguments;
    EXPECT_FALSE(fs::exists(dir_ / "r")) << arguments << " left a folder behind";
  }
}

TEST_F(Program, AnUnreadableCheckpointExitsWith1AndOneLine) {
  WriteFileAtomically(dir_ / "x.ckpt", "not a checkpoint");
  const Outcome outcome = Run("eval --checkpoint x.ckpt --task Hopper-v2");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_PRED1(OneLine, outcome.err);
}

TEST_F(Program, ListsForOtherProgramsAreJson) {
  const std::string all = Run("list --json").out;
  // Python reads the committed copy.
  EXPECT_EQ(all, ReadFile(O2V_SOURCE_DIR "/results/registry.json")) << "run `make report`";
  for (const char* entry :
       {R"({"id":"Reacher-v2","S":11,"A":2,"limit":50})",
        R"({"name":"Fish","first":"dm-fish-upright","second":"dm-fish-downleft"})",
        R"("name":"Option2Vec","revision":1,"options":true,"embedding":true})",
        R"("name":"DAC+PPO","revision":1,"options":true,"embedding":false})",
        R"("name":"PPO","revision":1,"options":false,"embedding":false})",
        R"("takes":"paper,released","methods":["dac_ppo","iopg","ppoc","oc"])"}) {
    EXPECT_NE(WithoutSpaces(all).find(entry), std::string::npos) << entry;
  }
  const std::string methods = WithoutSpaces(Run("list algorithms --json").out);
  EXPECT_TRUE(methods.starts_with(R"({"algorithms":[{"id":"option2vec",)")) << methods;
  EXPECT_EQ(methods.find("Reacher"), std::string::npos);
  EXPECT_EQ(Run("list").code, 2);
}

TEST_F(Program, ListsNameTasksMethodsAndSwitches) {
  const std::string tasks = Run("list tasks").out;  // task, S, A, time limit; then the pairs
  for (const char* row :
       {"task S A time limit [steps]", "Reacher-v2 11 2 50", "HumanoidStandup-v2 376 17 1000",
        "dm-fish-upright 21 5 1000", "Fish dm-fish-upright dm-fish-downleft"}) {
    EXPECT_NE(Squeezed(tasks).find(std::string("\n") + row + "\n"), std::string::npos) << row;
  }
  EXPECT_NE(Squeezed(Run("list algorithms").out).find("\ndac_onestep DAC-OneStep\n"),
            std::string::npos);
  const std::string switches = Run("list switches").out;
  EXPECT_NE(switches.find("o2v_dropout"), std::string::npos);
  EXPECT_NE(switches.find("[0, 0.9]"), std::string::npos) << "the values that it takes";
  // Columns switch, paper, released.
  for (const auto& [name, paper, released] : {std::tuple{"timelimit", "paper", "released"},
                                              {"o2v_dropout", "0", "0.2"},
                                              {"adv_std_eps", "1e-08", "0"},
                                              {"o2v_freeze", "paper", "released"},
                                              {"contact_forces", "off", "off"}}) {
    std::istringstream row(switches.substr(switches.find(std::string("\n") + name)));
    std::string cells[3];
    row >> cells[0] >> cells[1] >> cells[2];
    EXPECT_EQ(cells[0], name);
    EXPECT_EQ(cells[1], paper) << name;
    EXPECT_EQ(cells[2], released) << name;
  }
}

TEST_F(Program, ParamsPrintsThePapersRatio) {
  const std::string text = Run("params").out;
  EXPECT_NE(text.find("30598 / 193473 = 15.8 %"), std::string::npos) << text;
  // Spec 2.2, 2.6, 2.7, S = 17, A = 6. The rows of --csv: tests/report/param_table_test.cc.
  for (const char* size : {" 11085 ", " 31615 ", " 30598 "}) {
    EXPECT_NE(text.find(size), std::string::npos) << size;
  }
  const std::string csv = Run("params --csv").out;
  EXPECT_TRUE(csv.starts_with("task,S,A,method,fidelity,width,counted,used,share\n")) << csv;
  EXPECT_NE(csv.find("\nHalfCheetah-v2,17,6,option2vec,released,64,30598,30484,\n"),
            std::string::npos);
}

TEST_F(Program, TrainsIntoAFolderThatItThenRefusesOrLeavesAsItIs) {
  ASSERT_EQ(Train("--out run").code, 0);
  for (const char* file :
       {"config.toml", "episodes.csv", "updates.csv", "last.ckpt", "timing.csv", "manifest.json"}) {
    EXPECT_TRUE(fs::exists(dir_ / "run" / file)) << file;
  }
  EXPECT_EQ(Train("--out run").code, 2);
  const Outcome again = Train("--out run --resume");
  EXPECT_EQ(again.code, 0);
  EXPECT_EQ(again.err, "run: this run is already done\n");
}

TEST_F(Program, RunsAgainFromTheConfigThatItWrote) {
  ASSERT_EQ(Train("--out a --seed 3").code, 0);
  ASSERT_EQ(Run("train --config a/config.toml --out b --resume").code, 0);
  for (const char* file : {"config.toml", "episodes.csv", "updates.csv", "last.ckpt"}) {
    EXPECT_EQ(ReadFile(dir_ / "a" / file), ReadFile(dir_ / "b" / file)) << file;
  }
}

TEST_F(Program, EvaluatesACheckpointRepeatably) {
  ASSERT_EQ(Train("--out run").code, 0);
  const std::string eval = "eval --checkpoint run/last.ckpt --task InvertedPendulum-v2 ";
  const Outcome a = Run(eval + "--episodes 2 --seed 5"), b = Run(eval + "--episodes 2 --seed 5");
  EXPECT_EQ(a.code, 0) << a.err;
  EXPECT_EQ(a.out, b.out);
  EXPECT_NE(a.out, Run(eval + "--episodes 2 --seed 5 --action mean").out);
  EXPECT_EQ(Run(eval + "--algo option2vec").code, 2) << "the file says ppo";
}

TEST_F(Program, APolicyIsWhatItsFileSays) {
  ASSERT_EQ(Train("--out run").code, 0);
  WriteFileAtomically(dir_ / "in.csv", "s0,s1,s2,s3,o_prev,init,o\n0,0,0,0,0,1,0\n");
  for (const std::string command :
       {"eval --checkpoint run/last.ckpt --episodes 1",
        "forward --checkpoint run/last.ckpt --input in.csv --out o.csv"}) {
    EXPECT_EQ(Run(command + " --algo ppo --fidelity paper").code, 0) << command;
    for (const std::string other : {" --fidelity released", " --algo oc"}) {
      const Outcome outcome = Run(command + other);
      EXPECT_EQ(outcome.code, 2) << command << other;
      EXPECT_NE(outcome.err.find("run/last.ckpt: trained with '"), std::string::npos)
          << outcome.err;
    }
  }
}

TEST_F(Program, RecordsAFinishedRunAnew) {
  // 1100 steps are asked for, 1200 made: the record ends where the run was meant to.
  ASSERT_EQ(Run("train --task InvertedPendulum-v2 --algo ppo --steps 1100 --set rollout=300 "
                "--out run")
                .code,
            0);
  const std::string csv = ReadFile(dir_ / "run.csv"), json = ReadFile(dir_ / "run.json");
  EXPECT_NE(csv.find("\n1100,"), std::string::npos) << csv;
  ASSERT_EQ(Train("--out other").code, 0);
  const std::string other = ReadFile(dir_ / "other.json");
  for (const char* name : {"run.csv", "run.json", "other.csv", "other.json"}) {
    fs::remove(dir_ / name);
  }
  ASSERT_EQ(Run("record run other").code, 0);
  EXPECT_EQ(ReadFile(dir_ / "run.csv"), csv);
  EXPECT_EQ(ReadFile(dir_ / "run.json"), json);
  EXPECT_EQ(ReadFile(dir_ / "other.json"), other);
}

TEST_F(Program, WritesNetworkOutputs) {
  ASSERT_EQ(Train("--out run").code, 0);
  WriteFileAtomically(dir_ / "in.csv", "s0,s1,s2,s3,o_prev,init,o\n0,0,0,0,0,1,0\n1,2,3,4,0,0,0\n");
  const Outcome outcome = Run("forward --checkpoint run/last.ckpt --input in.csv --out out.csv");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const CsvTable table = ReadCsv(dir_ / "out.csv");
  EXPECT_EQ(table.columns, (std::vector<std::string>{"P0", "mu0", "sigma0", "q0"}));
  EXPECT_EQ(table.Rows(), 2u);
  EXPECT_EQ(table.At(0, 0), 1) << "one option";
}

TEST_F(Program, InterpretsTheEmbeddingRepeatably) {
  ASSERT_EQ(Run("train --task InvertedPendulum-v2 --algo option2vec --seed 3 --steps 256 "
                "--set rollout=64 --out run")
                .code,
            0);
  const Outcome outcome = Run("interpret run --episodes 2");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const std::string path = "results/interpret/paper/InvertedPendulum-v2/option2vec/seed-003.csv";
  EXPECT_TRUE(outcome.out.starts_with(path + ": 40 dimensions, ")) << outcome.out;
  EXPECT_NE(outcome.out.find("of 2 episodes on InvertedPendulum-v2\n"), std::string::npos);
  const CsvTable table = ReadCsv(dir_ / path);
  EXPECT_EQ(table.columns,
            (std::vector<std::string>{"dimension", "embedding_0", "embedding_1", "embedding_2",
                                      "embedding_3", "effect_0", "perturbed_0", "delta"}));
  EXPECT_EQ(table.Rows(), 40u);
  ASSERT_EQ(Run("interpret run/last.ckpt --episodes 2 --out new/b.csv").code, 0);
  EXPECT_EQ(ReadFile(dir_ / "new/b.csv"), ReadFile(dir_ / path));
  EXPECT_NE(ReadFile(dir_ / "new/b.json").find("\"episodes\": 2"), std::string::npos);
  EXPECT_EQ(Run("interpret run --episodes 2 --out c.json").code, 2);
  ASSERT_EQ(Run("interpret run --episodes 2 --seed 1 --out c.csv").code, 0);
  EXPECT_NE(ReadFile(dir_ / "c.csv"), ReadFile(dir_ / path));
  ASSERT_EQ(Run("interpret run --episodes 1 --seed 4 --delta 0.25 --out d.csv").code, 0);
  const CsvTable other = ReadCsv(dir_ / "d.csv");
  EXPECT_EQ(table.At(0, table.Column("delta")), 1) << "the default";
  EXPECT_EQ(other.At(0, other.Column("delta")), 0.25);
  EXPECT_NE(ReadFile(dir_ / "d.json").find("\"seed\": 4"), std::string::npos);
}

TEST_F(Program, InterpretsTheLastTaskOfAPairUnlessToldOtherwise) {
  ASSERT_EQ(
      Run("train --task CartPole --algo option2vec --steps 256 --set rollout=32 --out run").code,
      0);
  for (const char* task : {"dm-cartpole-balance_sparse", "dm-cartpole-balance"}) {
    const bool last = task == std::string("dm-cartpole-balance_sparse");
    const Outcome outcome = Run(std::string("interpret run --episodes 1") +
                                (last ? "" : " --task ") + (last ? "" : task));
    EXPECT_EQ(outcome.out, std::string("results/interpret/paper/") + task +
                               "/option2vec/seed-000.csv: 40 dimensions, 1000 states of 1 episodes "
                               "on " +
                               task + "\n")
        << outcome.err;
  }
}

TEST_F(Program, InterpretsOption2VecOnly) {
  ASSERT_EQ(Train("--out run").code, 0);
  const Outcome other = Run("interpret run");
  EXPECT_EQ(other.code, 2);
  EXPECT_EQ(other.err,
            "option2vec: run/last.ckpt: trained by ppo, whose options have no embedding\n");
  EXPECT_EQ(Run("interpret run --algo option2vec").code, 2) << "the file says ppo";
  // A file from elsewhere: an empty header, then one that holds nothing of Option2Vec.
  WriteFileAtomically(dir_ / "x", std::string("\2\0\0\0\0\0\0\0{}", 10));
  EXPECT_EQ(Run("interpret x").code, 2) << "it does not say what it is";
  const Outcome foreign = Run("interpret x --task Hopper-v2 --algo option2vec --out y.csv");
  EXPECT_EQ(foreign.code, 1);
  EXPECT_NE(foreign.err.find("x: embed.W_o is missing"), std::string::npos) << foreign.err;
  EXPECT_FALSE(fs::exists(dir_ / "y.csv"));
  EXPECT_FALSE(fs::exists(dir_ / "results"));
}

TEST_F(Program, TakesTheInstructionSetItIsTold) {
  const Outcome wrong = Run("list tasks", "O2V_ISA=v5");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_EQ(wrong.err, "option2vec: O2V_ISA: expected v3 or v4, got 'v5'\n");
  EXPECT_NE(Run("--version", "O2V_ISA=v3").out.find("\nproducts v3\n"), std::string::npos);
  const Outcome v4 = Run("--version", "O2V_ISA=v4");
  if (!HasV4()) {
    EXPECT_EQ(v4.code, 2);
    EXPECT_EQ(v4.err, "option2vec: O2V_ISA: v4, but this processor has no AVX-512\n");
    GTEST_SKIP() << "this processor has no AVX-512";
  }
  EXPECT_NE(v4.out.find("\nproducts v4\n"), std::string::npos);
  const std::string train =
      "train --task HalfCheetah-v2 --algo option2vec --steps 512 --set rollout=256 --out ";
  ASSERT_EQ(Run(train + "v3", "O2V_ISA=v3").code, 0);
  ASSERT_EQ(Run(train + "v4", "O2V_ISA=v4").code, 0);
  EXPECT_TRUE(ReadFile(dir_ / "v3/last.ckpt") == ReadFile(dir_ / "v4/last.ckpt"));
  EXPECT_NE(ReadFile(dir_ / "v4/manifest.json").find("\"products\": \"v4\""), std::string::npos);
}

TEST_F(Program, ReplayPassesOnItsOwnOutputAndFailsOnAnother) {
  WriteFileAtomically(dir_ / "in.csv",
                      "step,ctrl0,qpos0,qpos1,qvel0,qvel1\n0,1,0,0.1,0,0\n1,1,0,0,0,0\n");
  const std::string replay = "replay --task InvertedPendulum-v2 --trajectory ";
  const Outcome fail = Run(replay + "in.csv --out own.csv");
  EXPECT_EQ(fail.code, 1) << fail.err;
  EXPECT_EQ(fail.out.substr(0, 4), "FAIL");
  EXPECT_NE(fail.out.find("row 1"), std::string::npos) << fail.out;
  EXPECT_NE(fail.out.find("(tolerance 1e-09)"), std::string::npos) << fail.out;
  const Outcome wide = Run(replay + "in.csv --tolerance 1e3");
  EXPECT_EQ(wide.code, 0) << wide.err;
  EXPECT_EQ(wide.out.substr(0, 4), "PASS");
  EXPECT_NE(wide.out.find("(tolerance 1000)"), std::string::npos) << wide.out;
  const Outcome pass = Run(replay + "own.csv");
  EXPECT_EQ(pass.code, 0) << pass.out;
  EXPECT_EQ(pass.out.substr(0, 4), "PASS");
}

TEST_F(Program, JobsRunThenDisappearThenSummarise) {
  WriteFileAtomically(dir_ / "tiny.toml",
                      "[experiment]\ntasks = ['InvertedPendulum-v2']\nalgorithms = ['ppo']\n"
                      "fidelities = ['paper']\nseeds = [0, 1]\n"
                      "[run]\nsteps = 1024\n[algo.ppo]\nrollout = 512\n");
  const std::string jobs = Run("jobs tiny.toml").out;
  ASSERT_EQ(std::count(jobs.begin(), jobs.end(), '\n'), 2);
  EXPECT_EQ(std::system(("cd '" + dir_.path().string() + "' && sh -e stdout 2> /dev/null").c_str()),
            0);
  const Outcome again = Run("jobs tiny.toml");
  EXPECT_EQ(again.out, "");
  EXPECT_EQ(again.err, "");
  const Outcome progress = Run("progress tiny.toml");
  EXPECT_EQ(progress.out, "2 runs: 2 done, 0 left\n");
  const Outcome summary = Run("summary results/tiny");
  EXPECT_EQ(summary.code, 0) << summary.err;
  EXPECT_NE(summary.out.find("authors"), std::string::npos);
  EXPECT_NE(
      ReadFile(dir_ / "results/tiny/summary.csv").find("paper,InvertedPendulum-v2,ppo,1024,2,"),
      std::string::npos);
  // Every experiment has a table of its own.
  fs::copy(dir_ / "results/tiny", dir_ / "results/half", fs::copy_options::recursive);
  fs::remove(dir_ / "results/half/paper/InvertedPendulum-v2/ppo/seed-001.json");
  fs::remove(dir_ / "results/half/summary.csv");
  ASSERT_EQ(Run("summary results/tiny results/half").code, 0);
  for (const auto& [name, row] : {std::pair{"tiny", "ppo,1024,2,"}, {"half", "ppo,1024,1,"}}) {
    EXPECT_NE(ReadFile(dir_ / "results" / name / "summary.csv").find(row), std::string::npos);
  }
  // A damaged record does not count, and whoever lists runs says so.
  const std::string record = "results/tiny/paper/InvertedPendulum-v2/ppo/seed-001.json";
  WriteFileAtomically(dir_ / record, "{");
  for (const std::string command :
       {"summary results/tiny", "jobs tiny.toml", "progress tiny.toml"}) {
    const Outcome damaged = Run(command);
    EXPECT_EQ(damaged.code, 0) << command;
    EXPECT_TRUE(damaged.err.starts_with(record + ": ")) << command << ": " << damaged.err;
    EXPECT_TRUE(damaged.err.ends_with("\n1 records refused\n")) << command << ": " << damaged.err;
    EXPECT_EQ(damaged.out.find(" train "), std::string::npos) << "its run is not started again";
  }
}

TEST_F(Program, JobsAndProgressGoByTheRecords) {
  WriteFileAtomically(dir_ / "tiny.toml",
                      "[experiment]\ntasks = ['InvertedPendulum-v2']\nalgorithms = ['ppo']\n"
                      "fidelities = ['paper']\nseeds = [0, 1, 2, 3]\n"
                      "[run]\nsteps = 64\n[algo.ppo]\nrollout = 64\n");
  EXPECT_EQ(Run("progress tiny.toml --at-once 2").out,
            "4 runs: 0 done, 4 left, the time left is known after the first run\n");
  const std::string folder = "results/tiny/paper/InvertedPendulum-v2/ppo/";
  ASSERT_EQ(Run("train --config tiny.toml --task InvertedPendulum-v2 --algo ppo --seed 0 --out " +
                folder + "seed-000")
                .code,
            0);
  const std::string record = folder + "seed-000.json";
  const auto set = [&](const std::string& key, const std::string& value) {
    std::string json = ReadFile(dir_ / record);
    const std::size_t begin = json.find("\"" + key + "\": ") + key.size() + 4;
    json.replace(begin, json.find(',', begin) - begin, value);
    WriteFileAtomically(dir_ / record, json);
  };
  set("cpu_seconds", "7200.0");  // two hours each: six are left
  EXPECT_EQ(Run("progress tiny.toml").out,
            "4 runs: 1 done, 3 left, about 6.0 CPU hours, 6.0 h with 1 at a time\n");
  EXPECT_EQ(Run("progress tiny.toml --at-once 4").out,
            "4 runs: 1 done, 3 left, about 6.0 CPU hours, 1.5 h with 4 at a time\n");
  EXPECT_EQ(Run("progress tiny.toml --seeds 0,2").out,
            "2 runs: 1 done, 1 left, about 2.0 CPU hours, 2.0 h with 1 at a time\n");
  set("revision", "0");
  const Outcome jobs = Run("jobs tiny.toml");
  EXPECT_EQ(std::count(jobs.out.begin(), jobs.out.end(), '\n'), 3) << jobs.out;
  EXPECT_EQ(jobs.out.find("--seed 0 "), std::string::npos) << "not made again by itself";
  EXPECT_EQ(jobs.err, folder + "seed-000: made by an older revision of the method\n");
  EXPECT_TRUE(
      Run("progress tiny.toml")
          .out.starts_with("4 runs: 1 done (1 by older revisions of their methods), 3 left"));
}

}  // namespace
}  // namespace o2v
