// The program from outside: standard streams, special files, names, numbers, signals.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "base/csv.h"
#include "base/files.h"
#include "program.h"
#include "test_folder.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;

class Streams : public testing::Test {
 protected:
  /// Runs a line of shell in the test's own folder; $O is the program, $TRAIN a short run.
  Outcome Shell(const std::string& line) const {
    const std::string train =
        "\"$O\" train --task InvertedPendulum-v2 --algo ppo --set rollout=64 --steps 128 ";
    std::string text = line;
    for (std::size_t i; (i = text.find("$TRAIN")) != std::string::npos;) text.replace(i, 6, train);
    WriteFileAtomically(dir_ / "line.sh",
                        "O='" O2V_PROGRAM "'; S='" O2V_SOURCE_DIR "/scripts'\n" + text + "\n");
    const int status = std::system(
        ("cd '" + (dir_ / "").string() + "' && bash line.sh > stdout 2> stderr < /dev/null")
            .c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, ReadFile(dir_ / "stdout"),
            ReadFile(dir_ / "stderr")};
  }
  /// The message, without the program's name, of a line that must be refused.
  std::string Refused(const std::string& line) const {
    const Outcome outcome = Shell(line);
    EXPECT_EQ(outcome.code, 2) << line << "\n" << outcome.err;
    return outcome.err.substr(std::min(outcome.err.size(), sizeof "option2vec: " - 1));
  }
  std::string Text(const std::string& name) const { return ReadFile(dir_ / name); }

  TestFolder dir_;
};

TEST_F(Streams, ThatAreClosedChangeNothing) {
  ASSERT_EQ(Shell("$TRAIN --out open").code, 0);
  const char* closed[] = {"<&-", ">&-", "2>&-", "<&- >&-", ">&- 2>&-", "<&- 2>&-", "<&- >&- 2>&-"};
  const Outcome list = Shell("\"$O\" list tasks >&-");
  EXPECT_EQ(list.code, 0);
  EXPECT_EQ(list.err, "");
  for (std::size_t i = 0; i < std::size(closed); ++i) {
    const std::string run = std::to_string(i);
    EXPECT_EQ(Shell("$TRAIN --out " + run + " " + closed[i]).code, 0) << closed[i];
    for (const char* file : {"/config.toml", "/episodes.csv", "/updates.csv", "/last.ckpt"}) {
      EXPECT_TRUE(Text(run + file) == Text(std::string("open") + file)) << closed[i] << file;
    }
    EXPECT_EQ(ReadCsv(dir_ / (run + "/timing.csv")).Rows(), 2u) << closed[i];
  }
}

TEST_F(Streams, ThatLoseOutputAreNoSuccess) {
  ASSERT_EQ(Shell("$TRAIN --out run").code, 0);
  for (const char* arguments : {"--help", "params", "params --csv", "list tasks", "list algorithms",
                                "list switches", "jobs quick", "progress quick",
                                "eval --checkpoint run/last.ckpt --episodes 1", "train --help"}) {
    const Outcome outcome = Shell(std::string("\"$O\" ") + arguments + " > /dev/full");
    EXPECT_EQ(outcome.code, 1) << arguments;
    EXPECT_EQ(outcome.err, "option2vec: standard output: cannot write: No space left on device\n")
        << arguments;
  }
  EXPECT_EQ(Shell("\"$O\" replay > /dev/full").code, 2) << "nothing was lost";
}

TEST_F(Streams, AreWrittenIntoByForward) {
  ASSERT_EQ(Shell("$TRAIN --out run").code, 0);
  WriteFileAtomically(dir_ / "in.csv", "s0,s1,s2,s3,o_prev,init,o\n0,0,0,0,0,1,0\n");
  const std::string forward = "\"$O\" forward --checkpoint run/last.ckpt --input in.csv --out ";
  ASSERT_EQ(Shell(forward + "out.csv").code, 0);
  const std::string expected = Text("out.csv");
  EXPECT_EQ(Shell(forward + "/dev/stdout").out, expected);
  EXPECT_EQ(Shell("echo first; " + forward + "/dev/stdout").out, "first\n" + expected);
  EXPECT_EQ(Shell("mkfifo fifo; cat fifo & " + forward + "fifo; wait").out, expected);
  EXPECT_EQ(Shell("ln -s there link; " + forward + "link; cat there; readlink link").out,
            expected + "there\n");
  EXPECT_EQ(Shell(forward + "/dev/null; test -c /dev/null").code, 0);
  const Outcome full = Shell(forward + "/dev/full");
  EXPECT_EQ(full.code, 1);
  EXPECT_EQ(full.err, "option2vec: /dev/full: cannot write: No space left on device\n");
}

TEST_F(Streams, AreWrittenIntoByReplayAndInterpret) {
  WriteFileAtomically(dir_ / "in.csv",
                      "step,ctrl0,qpos0,qpos1,qvel0,qvel1\n0,1,0,0.1,0,0\n1,1,0,0,0,0\n");
  const std::string replay =
      "\"$O\" replay --task InvertedPendulum-v2 --tolerance 9 --trajectory in.csv --out ";
  ASSERT_EQ(Shell(replay + "out.csv").code, 0);
  const Outcome shown = Shell(replay + "/dev/stdout");
  EXPECT_TRUE(shown.out.starts_with(Text("out.csv") + "PASS")) << shown.out;

  ASSERT_EQ(Shell("\"$O\" train --task InvertedPendulum-v2 --algo option2vec --steps 64 --set "
                  "rollout=64 --out run")
                .code,
            0);
  const std::string interpret = "\"$O\" interpret run --episodes 1 --out ";
  EXPECT_EQ(Shell(interpret + "/dev/null; test -c /dev/null && ! test -e /dev/null.json").code, 0);
  ASSERT_EQ(Shell(interpret + "a.csv").code, 0);
  EXPECT_EQ(Shell(interpret + "b.csv > c; cat b.csv").out, Text("a.csv"));
  EXPECT_TRUE(Shell(interpret + "/dev/stdout").out.starts_with(Text("a.csv") + "/dev/stdout: 40 "));
}

TEST_F(Streams, InterpretReplacesOnlyWhatItWrote) {
  ASSERT_EQ(Shell("\"$O\" train --task InvertedPendulum-v2 --algo option2vec --steps 64 --set "
                  "rollout=64 --out run")
                .code,
            0);
  const std::string interpret = "\"$O\" interpret run --episodes 1 --out ";
  for (const char* name : {"emb.csv", "emb.json"}) {
    WriteFileAtomically(dir_ / name, "{\"mine\": 1}");
    EXPECT_EQ(Refused(interpret + "emb.csv"),
              std::string(name) + ": not written by `interpret`; move it away first\n");
    EXPECT_EQ(Text(name), "{\"mine\": 1}");
    fs::remove(dir_ / name);
    EXPECT_FALSE(fs::exists(dir_ / "emb.csv") || fs::exists(dir_ / "emb.json"));
  }
  EXPECT_EQ(Refused(interpret + "run.csv"),
            "run.csv: not written by `interpret`; move it away first\n")
      << "it is a record";
  EXPECT_EQ(Shell(interpret + "emb.csv").code, 0);
  EXPECT_EQ(Shell(interpret + "emb.csv").code, 0) << "its own";
  EXPECT_EQ(Refused("mkdir d; " + interpret + "d"), "d: is a folder\n");
}

TEST_F(Streams, FoldersHaveOneNameAndOneRecord) {
  EXPECT_EQ(Shell("mkdir a b c; cd a; $TRAIN --out .").code, 0);
  EXPECT_EQ(Shell("$TRAIN --out b/.").code, 0);
  EXPECT_EQ(Shell("$TRAIN --out ./c//").code, 0);
  for (const char* run : {"a", "b", "c"}) {
    for (const char* ending : {".csv", ".json"}) {
      EXPECT_TRUE(fs::remove(dir_ / (std::string(run) + ending))) << run << ending;
    }
  }
  EXPECT_EQ(Shell("cd a && \"$O\" record . ../b/ ../c/.").code, 0);
  EXPECT_EQ(Shell("ls -A | grep -v -e line.sh -e stdout -e stderr | tr '\\n' ' '; ls -A a").out,
            "a a.csv a.json b b.csv b.json c c.csv c.json config.toml\nepisodes.csv\nlast.ckpt\n"
            "manifest.json\ntiming.csv\nupdates.csv\n");
  EXPECT_EQ(Refused("$TRAIN --out /"), "'/': not the folder of a run\n");
  EXPECT_EQ(Refused("$TRAIN --out ''"), "'': not the folder of a run\n");
}

TEST_F(Streams, NumbersAreDecimalEverywhere) {
  ASSERT_EQ(Shell("$TRAIN --seed 010 --out run").code, 0);
  EXPECT_NE(Text("run/config.toml").find("\nseed = 10\nsteps = 128\n"), std::string::npos);
  const std::string base = "\"$O\" train --task InvertedPendulum-v2 --algo ppo --set rollout=64 ";
  ASSERT_EQ(Shell(base + "--steps 0512 --seed 1e1 --set hidden=01e1 --out other").code, 0);
  EXPECT_NE(Text("other/config.toml").find("\nseed = 10\nsteps = 512\n"), std::string::npos);
  EXPECT_NE(Text("other/config.toml").find("\nhidden = 10\n"), std::string::npos);

  const std::string eval = "\"$O\" eval --checkpoint run/last.ckpt ";
  EXPECT_EQ(Shell(eval + "--episodes 010 --seed 07").out, Shell(eval + "--seed 7").out);
  for (const char* number : {"''", "-1", "0x10", "1.5", "18446744073709551615", "1_0", "+1", "a"}) {
    for (const std::string& line :
         {base + "--steps 64 --out r --seed ", base + "--out r --steps ", eval + "--seed ",
          eval + "--episodes ", std::string("\"$O\" interpret run --seed "),
          std::string("\"$O\" progress quick --at-once ")}) {
      const std::string message = Refused(line + number);
      EXPECT_NE(message.find(" is not a whole number in ["), std::string::npos) << line << message;
    }
    for (const char* key : {"steps", "hidden", "workers"}) {
      EXPECT_NE(Refused(base + "--steps 64 --out r --set " + key + "=" + number), "") << key;
    }
    EXPECT_NE(Refused(std::string("\"$O\" jobs quick --seeds ") + number), "");
  }
  for (const char* number : {"''", "-1", "0x1p3", "inf", "nan", "a"}) {
    EXPECT_NE(Refused(std::string("\"$O\" interpret run --delta ") + number), "");
    EXPECT_NE(
        Refused("\"$O\" replay --task Hopper-v2 --trajectory x --tolerance " + std::string(number)),
        "");
  }
  EXPECT_FALSE(fs::exists(dir_ / "r"));
  EXPECT_EQ(Shell("\"$O\" jobs quick --seeds 08,010-011").out,
            Shell("\"$O\" jobs quick --seeds 8,10,11").out);
}

TEST_F(Streams, WholeNumbersOfAConfigFollowTheSameRule) {
  WriteFileAtomically(dir_ / "x.toml", "[run]\nsteps = 1.28e2\n[algo.ppo]\nhidden = 1e1\n");
  const std::string train =
      "\"$O\" train --task InvertedPendulum-v2 --algo ppo --set rollout=64 --config x.toml --out ";
  ASSERT_EQ(Shell(train + "run").code, 0);
  EXPECT_NE(Text("run/config.toml").find("\nsteps = 128\n"), std::string::npos);
  EXPECT_NE(Text("run/config.toml").find("\nhidden = 10\n"), std::string::npos);
  for (const char* bad : {"[run]\nsteps = 1.5\n", "[algo.ppo]\nhidden = 1.5\n"}) {
    WriteFileAtomically(dir_ / "x.toml", bad);
    EXPECT_NE(Refused(train + "r").find(", not a whole number"), std::string::npos) << bad;
  }
}

TEST_F(Streams, MessagesHoldNothingThatATerminalObeys) {
  WriteFileAtomically(dir_ / "x.toml", "[run]\ntask = \"a\\u001b[31mb\\u009bc\"\n");
  EXPECT_TRUE(Refused("\"$O\" train --algo ppo --out r --task 'a\x1b[31mb\nc'")
                  .starts_with("--task: unknown task 'a?[31mb?c'; nearest: "));
  EXPECT_TRUE(Refused("\"$O\" train --algo ppo --out r --config x.toml")
                  .starts_with("x.toml:2: unknown task 'a?[31mb?c'; nearest: "));
}

TEST_F(Streams, OneSampleARolloutIsAnErrorOfTheConfiguration) {
  EXPECT_EQ(Refused("$TRAIN --out r --set rollout=1 --set workers=1"),
            "--set rollout=1: 'rollout' is 1 with one worker; advantages are normalised over at "
            "least two samples\n");
  EXPECT_FALSE(fs::exists(dir_ / "r"));
}

TEST_F(Streams, JobsKeepTheirFoldersNames) {
  WriteFileAtomically(dir_ / "tiny.toml",
                      "[experiment]\ntasks = ['InvertedPendulum-v2']\nalgorithms = ['ppo']\n"
                      "fidelities = ['paper']\nseeds = [0]\n"
                      "[run]\nsteps = 128\n[algo.ppo]\nrollout = 64\n");
  const std::string results = "'a|b&c\\d'";
  ASSERT_EQ(Shell("\"$O\" jobs tiny.toml --results " + results + " > list").code, 0);
  const std::string list = Text("list");
  const std::string line = "$S/run_job.sh \"$(cat list)\"";
  const Outcome first = Shell(line);
  EXPECT_EQ(first.code, 0);
  const std::string label = "'a|b&c\\d/tiny/paper/InvertedPendulum-v2/ppo/seed-000': ";
  EXPECT_TRUE(first.out.starts_with(label + "step 64/128  ")) << first.out << first.err;
  EXPECT_TRUE(fs::exists(dir_ / "a|b&c\\d/tiny/paper/InvertedPendulum-v2/ppo/seed-000.json"));
  // The same line again, as of a task that is queued anew: nothing is left to do.
  const Outcome again = Shell("GRID='tiny.toml --results elsewhere' " + line);
  EXPECT_EQ(again.code, 0);
  EXPECT_EQ(again.out, label +
                           "a|b&c\\d/tiny/paper/InvertedPendulum-v2/ppo/seed-000: this run is "
                           "already done\n1 runs: 0 done, 1 left, the time left is known after "
                           "the first run\n");
  EXPECT_EQ(Shell("$S/run_job.sh 'exit 3'").code, 0) << "diverged";
  EXPECT_EQ(Shell("$S/run_job.sh 'exit 2'").code, 2);
}

TEST_F(Streams, ASignalStopsALongEvaluation) {
  // The evaluation after the first update would take a while; timing.csv is there from the start.
  const Outcome stopped = Shell(
      "(exec $TRAIN --set eval_every=64 --set eval_episodes=100000 --out run) & "
      "until test -s run/timing.csv; do sleep 0.05; done; sleep 0.5; kill -TERM $!; wait $!");
  EXPECT_EQ(stopped.code, 1);
  EXPECT_EQ(stopped.err, "option2vec: run: stopped by a signal; use --resume to continue\n");
  EXPECT_NE(Text("run/manifest.json").find("\"stopped\""), std::string::npos);
}

}  // namespace
}  // namespace o2v
