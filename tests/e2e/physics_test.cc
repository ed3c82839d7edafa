// The system's libmujoco and upstream's own build of it, which scripts/deps_physics.sh fetches: the
// same bytes by either, and nothing else gets in.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "base/csv.h"
#include "env/mujoco_env.h"
#include "program.h"
#include "run/config.h"
#include "run/trainer.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;

// Pinned by scripts/deps_physics.sh.
constexpr const char* kUpstreamSha256 =
    "63bb16223b4ef9b86485aea53a9c83d61506ed3131dfd4b62c001f24809d4d61";

/// The program with one library or the other.
class BothLibraries : public Program {
 protected:
  void SetUp() override {
    if (!fs::exists(kUpstream)) GTEST_SKIP() << kUpstream << " is not there, see `make deps`";
    ASSERT_NE(Run("--version", kSystems).out.find(fs::canonical(O2V_SYSTEM_PHYSICS).string()),
              std::string::npos);
    ASSERT_NE(Run("--version", kOwn).out.find(fs::canonical(kUpstream).string()),
              std::string::npos);
  }

  static std::string In(const fs::path& folder) {
    return "LD_LIBRARY_PATH='" + folder.string() + "'";
  }
  const fs::path kUpstream = O2V_SOURCE_DIR "/build/physics/libmujoco.so.2.2.2";
  const std::string kSystems = In(fs::path(O2V_SYSTEM_PHYSICS).parent_path());
  const std::string kOwn = In(kUpstream.parent_path());
};

/// A task's first state and 200 random actions, with room for all that a replay returns.
CsvTable RandomTrajectory(const std::string& task) {
  constexpr std::size_t kSteps = 200;
  const auto env = MakeEnv(task, {});
  auto& sim = dynamic_cast<MujocoEnv&>(*env);
  CsvTable table;
  table.columns = {"step"};
  const auto add = [&](const char* name, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) table.columns.push_back(name + std::to_string(i));
  };
  const EnvSpec& spec = sim.Spec();
  const std::size_t A = spec.a_low.size(), S = std::size_t(spec.S);
  add("ctrl", A);
  add("qpos", sim.qpos().size());
  add("qvel", sim.qvel().size());
  table.columns.insert(table.columns.end(), {"reward", "terminated"});
  add("obs", S);
  add("target", sim.Target().size());
  table.values.assign((kSteps + 1) * table.columns.size(), 0);

  Rng rng(18, task);
  std::vector<double> obs(S);
  sim.Reset(rng, obs);
  const auto state = table.values.begin() + std::ptrdiff_t(1 + A);
  std::ranges::copy(sim.qvel(), std::ranges::copy(sim.qpos(), state).out);
  std::ranges::copy(sim.Target(),
                    state + std::ptrdiff_t(sim.qpos().size() + sim.qvel().size() + 2 + S));
  for (std::size_t step = 0; step <= kSteps; ++step) {
    double* const row = &table.values[step * table.columns.size()];
    row[0] = double(step);
    for (std::size_t i = 0; i < A; ++i) row[1 + i] = rng.Uniform(spec.a_low[i], spec.a_high[i]);
  }
  return table;
}

TEST_F(BothLibraries, GiveTheSameBytesOnEveryTask) {
  for (const EnvEntry& task : EnvRegistry()) {
    WriteFileAtomically(dir_ / "in.csv", CsvText(RandomTrajectory(task.id)));
    const std::string replay = "replay --task " + task.id + " --tolerance ";
    const Outcome first = Run(replay + "1e300 --trajectory in.csv --out system.csv", kSystems);
    ASSERT_EQ(first.code, 0) << task.id << ": " << first.out << first.err;
    const Outcome second = Run(replay + "0 --trajectory system.csv --out upstream.csv", kOwn);
    EXPECT_EQ(second.code, 0) << task.id << ": " << second.out << second.err;
    EXPECT_TRUE(ReadFile(dir_ / "system.csv") == ReadFile(dir_ / "upstream.csv")) << task.id;
  }
}

TEST_F(BothLibraries, ARunBegunWithOneEndsWithEitherInTheSameBytes) {
  RunRequest request;
  request.task = "Hopper-v2";
  request.algorithm = "option2vec";
  request.set = {"rollout=64", "minibatch=32", "epochs=2", "checkpoint_every=64"};
  request.steps = 512;
  const RunConfig config = ResolveRun(request);
  RunHooks hooks;
  hooks.stop = [] { return true; };  // after the first rollout
  std::ostringstream progress;
  ASSERT_EQ(o2v::Train(config, dir_ / "system", /*resume=*/false, progress, false, hooks),
            RunStatus::kStopped);
  fs::copy(dir_ / "system", dir_ / "upstream");
  const std::string train = "train --config system/config.toml --resume --out ";
  ASSERT_EQ(Run(train + "system", kSystems).code, 0);
  ASSERT_EQ(Run(train + "upstream", kOwn).code, 0);
  ASSERT_EQ(Run(train + "whole", kOwn).code, 0);
  for (const char* file : {"episodes.csv", "updates.csv", "last.ckpt"}) {
    EXPECT_TRUE(ReadFile(dir_ / "whole" / file) == ReadFile(dir_ / "system" / file)) << file;
    EXPECT_TRUE(ReadFile(dir_ / "whole" / file) == ReadFile(dir_ / "upstream" / file)) << file;
  }
  const auto manifest = [&](const char* run) {
    return nlohmann::json::parse(ReadFile(dir_ / run / "manifest.json")).at("physics");
  };
  EXPECT_EQ(manifest("system").at("file"), fs::canonical(O2V_SYSTEM_PHYSICS).string());
  EXPECT_EQ(manifest("upstream").at("file"), fs::canonical(kUpstream).string());
  EXPECT_EQ(manifest("upstream").at("sha256"), kUpstreamSha256);
}

/// scripts/deps_physics.sh in a tree of its own, with a python3 whose `pip download` is ours.
class FetchedLibrary : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directory(dir_ / "scripts");
    fs::copy(O2V_SOURCE_DIR "/scripts/deps_physics.sh", dir_ / "scripts");
  }
  /// `download` are shell commands; $dest is where the wheel goes.
  Outcome Fetch(const std::string& download, const std::string& environment = "") {
    WriteFileAtomically(dir_ / "python3",
                        "#!/bin/sh\nwhile [ \"$1\" != --dest ]; do shift; done\n"
                        "dest=$2\n" +
                            download + "\n");
    fs::permissions(dir_ / "python3", fs::perms::owner_all);
    const std::string dir = dir_.path().string();
    return Shell("PATH='" + dir + "':\"$PATH\" " + environment + " '" + dir +
                 "/scripts/deps_physics.sh'");
  }
  Outcome Shell(const std::string& command) {
    const std::string dir = dir_.path().string();
    const int status = std::system((command + " > '" + dir + "/out' 2> '" + dir + "/err'").c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, ReadFile(dir_ / "out"),
            ReadFile(dir_ / "err")};
  }
  /// Files that were left in build/physics.
  std::ptrdiff_t Left() const {
    const fs::path physics = dir_ / "build" / "physics";
    if (!fs::exists(physics)) return 0;
    return std::distance(fs::directory_iterator(physics), fs::directory_iterator());
  }

  const TestFolder dir_;
};

TEST_F(FetchedLibrary, WithAWrongHashIsRefused) {
  const Outcome wheel = Fetch("echo evil > \"$dest/mujoco-2.2.2-cp310.whl\"");
  EXPECT_EQ(wheel.code, 1);
  EXPECT_EQ(wheel.err, "deps: the wheel of mujoco 2.2.2 has a wrong SHA-256: not used\n");
  EXPECT_EQ(Left(), 0);
}

TEST_F(FetchedLibrary, ThatWasChangedIsRemoved) {
  fs::create_directories(dir_ / "build" / "physics");
  WriteFileAtomically(dir_ / "build" / "physics" / "libmujoco.so.2.2.2", "evil");
  const Outcome changed = Fetch("exit 1");
  EXPECT_EQ(changed.code, 1);
  EXPECT_EQ(changed.err,
            "deps: build/physics/libmujoco.so.2.2.2 had a wrong SHA-256 and was removed\n");
  EXPECT_EQ(Left(), 0);
}

TEST_F(FetchedLibrary, IsDoneWithoutWhenThereIsNoNetworkOrNoWish) {
  const Outcome offline = Fetch("exit 1");
  EXPECT_EQ(offline.code, 0);
  EXPECT_EQ(
      offline.out,
      "deps: MuJoCo's own library cannot be fetched from PyPI; physics is Debian's libmujoco, "
      "slower\n");
  EXPECT_EQ(Left(), 0);
  const Outcome unwanted = Fetch("exit 1", "PHYSICS=debian");
  EXPECT_EQ(unwanted.code, 0);
  EXPECT_EQ(unwanted.out, "deps: physics is Debian's libmujoco (PHYSICS=debian)\n");
  EXPECT_EQ(Fetch("exit 1", "PHYSICS=own").code, 2);
}

}  // namespace
}  // namespace o2v
