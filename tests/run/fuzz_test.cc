// Damaged files: each is refused with an Error or, where the damage is harmless, gives the same
// values.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "base/csv.h"
#include "base/rng.h"
#include "fake_run.h"
#include "run/checkpoint.h"
#include "run/config.h"
#include "run/metrics.h"

namespace o2v {
namespace {

constexpr int kDamages = 200;  // of each kind

/// Calls use(damaged, what) for seeded truncations, then for seeded flips of one bit.
template <typename Use>
void ForEachDamage(const std::string& text, Use&& use) {
  Rng rng(11, "damage");
  for (int i = 0; i < 2 * kDamages; ++i) {
    const std::size_t at = rng.UniformInt(text.size());
    std::string damaged = text.substr(0, at);
    std::string what = Concat("cut at byte ", at);
    if (i >= kDamages) {
      const int bit = static_cast<int>(rng.UniformInt(8));
      damaged = text;
      damaged[at] = static_cast<char>(damaged[at] ^ (1 << bit));
      what = Concat("bit ", bit, " of byte ", at);
    }
    use(damaged, what);
  }
}

/// Like WriteFileAtomically, without waiting for the disk: there are thousands of files to write.
void Write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

/// True when `load` throws Error. Anything else that it throws fails the test.
template <typename Load>
bool Refuses(Load&& load) {
  try {
    load();
    return false;
  } catch (const Error&) {
    return true;
  }
}

struct State {
  explicit State(std::uint64_t seed)
      : env([] { return std::make_unique<FakeEnv>(); }, 2, seed), algorithm(env.Spec(), seed) {
    env.Reset();
  }
  StateWalk Walk() {
    return [this](StateVisitor& v) {
      algorithm.Serialize(v);
      env.Serialize(v);
    };
  }
  /// All state as text.
  std::string Bytes(const std::filesystem::path& path) {
    SaveCheckpoint(path, {{"config", ToToml(FakeConfig())}}, algorithm, Walk());
    return ReadFile(path);
  }

  VecEnv env;
  FakeAlgorithm algorithm;
};

TEST(DamagedCheckpoint, IsRefusedByAResumedRunWithoutATrace) {
  TestFolder dir;
  const std::string good = State(1).Bytes(dir / "good");
  State other(2);
  const std::string before = other.Bytes(dir / "other");
  ForEachDamage(good, [&](const std::string& damaged, const std::string& what) {
    Write(dir / "x", damaged);
    EXPECT_TRUE(Refuses([&] { LoadCheckpoint(dir / "x", other.algorithm, other.Walk()); })) << what;
  });
  EXPECT_TRUE(other.Bytes(dir / "other") == before);
}

TEST(DamagedCheckpoint, GivesTheSamePolicyOrNone) {
  TestFolder dir;
  State good(1);
  const std::string text = good.Bytes(dir / "good");
  State other(2);
  Normalizer normalizer(2);
  int accepted = 0;
  ForEachDamage(text, [&](const std::string& damaged, const std::string& what) {
    Write(dir / "x", damaged);
    if (Refuses([&] { LoadPolicy(dir / "x", other.algorithm, normalizer); })) return;
    ++accepted;  // the key or value "format" was hit: a file from elsewhere; the values are whole
    EXPECT_EQ(other.algorithm.Params()[0]->value, good.algorithm.Params()[0]->value) << what;
    EXPECT_EQ(other.algorithm.Params()[1]->value, good.algorithm.Params()[1]->value) << what;
    EXPECT_EQ(normalizer.mean(), good.env.normalizer().mean()) << what;
  });
  EXPECT_LT(accepted, kDamages / 10);
}

TEST(DamagedConfig, OfARunFolderIsRefused) {
  TestFolder dir;
  const RunConfig config = FakeConfig();
  std::ostringstream progress;
  RunHooks hooks;
  hooks.stop = [] { return true; };
  Train(config, FakeParts(config), dir / "run", false, progress, false, hooks);
  const std::filesystem::path path = dir / "run" / "config.toml";
  ForEachDamage(ReadFile(path), [&](const std::string& damaged, const std::string& what) {
    Write(path, damaged);
    EXPECT_TRUE(Refuses([&] {
      Train(config, FakeParts(config), dir / "run", true, progress, false);
    })) << what;
  });
}

TEST(DamagedConfig, IsRefusedOrIsAWholeConfig) {
  const std::string good = ToToml(ResolveRun({.task = "Hopper-v2",
                                              .algorithm = "ppo",
                                              .fidelity = {},
                                              .seed = {},
                                              .steps = {},
                                              .config = {},
                                              .set = {}}));
  ForEachDamage(good, [&](const std::string& damaged, const std::string& what) {
    // A flipped digit is another valid number: no more can be asked of it than that it is kept.
    RunConfig config;
    if (Refuses([&] { config = ParseRunConfig(damaged, "x.toml"); })) return;
    EXPECT_EQ(ToToml(ParseRunConfig(ToToml(config), "y.toml")), ToToml(config)) << what;
  });
}

/// Copies the integers of a log's state to another log.
struct Carrier final : StateVisitor {
  void Matrix(std::string_view, Mat&) override {}
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view name, std::int64_t* x, std::size_t) override {
    if (const auto it = values.find(name); it != values.end()) {
      *x = it->second;
    } else {
      values.emplace(name, *x);
    }
  }
  std::map<std::string, std::int64_t, std::less<>> values;
};

TEST(DamagedLog, IsRefusedOrLosesOnlyWhatIsCutAnyway) {
  TestFolder dir;
  const std::filesystem::path path = dir / "x.csv";
  Carrier state;
  CsvLog log(path, "step,return");
  log.Create();
  for (int i = 0; i < 100; ++i) log.Row({std::to_string(i), std::to_string(i * i)});
  log.Flush();
  const std::string kept = ReadFile(path);
  log.Serialize(state, "log");
  for (int i = 0; i < 100; ++i) log.Row({"1", "2"});
  log.Flush();
  int accepted = 0;
  ForEachDamage(ReadFile(path), [&](const std::string& damaged, const std::string& what) {
    Write(path, damaged);
    CsvLog resumed(path, "step,return");
    resumed.Serialize(state, "log");
    if (Refuses([&] { resumed.Resume(); })) {
      EXPECT_TRUE(ReadFile(path) == damaged) << what;
    } else {
      ++accepted;
      EXPECT_TRUE(ReadFile(path) == kept) << what;
    }
  });
  EXPECT_GT(accepted, 0);
  EXPECT_LT(accepted, 2 * kDamages);
}

TEST(DamagedTable, IsRefusedOrIsAWholeTable) {
  TestFolder dir;
  CsvTable good{"", {"step", "qpos0", "qpos1"}, {}};
  Rng rng(5, "table");
  for (int i = 0; i < 90; ++i) good.values.push_back(rng.Normal());
  ForEachDamage(CsvText(good), [&](const std::string& damaged, const std::string& what) {
    // A flipped digit is another valid number here, too.
    Write(dir / "x.csv", damaged);
    CsvTable table;
    if (Refuses([&] { table = ReadCsv(dir / "x.csv"); })) return;
    EXPECT_EQ(table.columns.size(), 3u) << what;
    EXPECT_EQ(table.values.size(), table.Rows() * 3) << what;
    for (const double x : table.values) EXPECT_TRUE(std::isfinite(x)) << what;
  });
}

}  // namespace
}  // namespace o2v
