#include <gtest/gtest.h>

#include "base/check.h"
#include "env/env.h"
#include "env/pairs.h"

namespace o2v {
namespace {

// Source: spec E.1 to E.4; actions and bounds from the model dumps.
struct Fact {
  const char* id;
  int S, A, limit;
  double bound;
};
constexpr Fact kFacts[] = {
    {"HalfCheetah-v2", 17, 6, 1000, 1},     {"Ant-v2", 111, 8, 1000, 1},
    {"Hopper-v2", 11, 3, 1000, 1},          {"Walker2d-v2", 17, 6, 1000, 1},
    {"Swimmer-v2", 8, 2, 1000, 1},          {"Reacher-v2", 11, 2, 50, 1},
    {"Humanoid-v2", 376, 17, 1000, 0.4},    {"HumanoidStandup-v2", 376, 17, 1000, 0.4},
    {"InvertedPendulum-v2", 4, 1, 1000, 3}, {"InvertedDoublePendulum-v2", 11, 1, 1000, 1},
    {"dm-cartpole-balance", 5, 1, 1000, 1}, {"dm-cartpole-balance_sparse", 5, 1, 1000, 1},
    {"dm-reacher-easy", 6, 2, 1000, 1},     {"dm-reacher-hard", 6, 2, 1000, 1},
    {"dm-cheetah-run", 17, 6, 1000, 1},     {"dm-cheetah-backward", 17, 6, 1000, 1},
    {"dm-fish-upright", 21, 5, 1000, 1},    {"dm-fish-downleft", 21, 5, 1000, 1},
    {"dm-walker-squat", 24, 6, 1000, 1},    {"dm-walker-stand", 24, 6, 1000, 1},
    {"dm-walker-walk", 24, 6, 1000, 1},     {"dm-walker-backward", 24, 6, 1000, 1},
};

TEST(EnvRegistry, HoldsAllTasksWithTheirFacts) {
  EXPECT_EQ(EnvRegistry().size(), std::size(kFacts));
  for (const Fact& fact : kFacts) {
    const EnvSpec spec = MakeEnv(fact.id, EnvOptions{})->Spec();
    EXPECT_EQ(spec.id, fact.id);
    EXPECT_EQ(spec.S, fact.S) << fact.id;
    EXPECT_EQ(spec.A, fact.A) << fact.id;
    EXPECT_EQ(spec.time_limit, fact.limit) << fact.id;
    EXPECT_EQ(spec.a_low, std::vector<double>(std::size_t(fact.A), -fact.bound)) << fact.id;
    EXPECT_EQ(spec.a_high, std::vector<double>(std::size_t(fact.A), fact.bound)) << fact.id;
  }
}

TEST(EnvRegistry, EveryLineMakesTheTaskOfItsName) {
  for (const EnvEntry& entry : EnvRegistry()) {
    EXPECT_EQ(entry.make(EnvOptions{}, entry.time_limit)->Spec().id, entry.id);
  }
}

TEST(Pairs, AreThoseOfTheSpecInTheirOrder) {
  // Source: spec E.4.
  const std::vector<std::pair<std::string, std::string>> expected = {
      {"CartPole", "dm-cartpole-balance,dm-cartpole-balance_sparse"},
      {"Reacher", "dm-reacher-easy,dm-reacher-hard"},
      {"Cheetah", "dm-cheetah-run,dm-cheetah-backward"},
      {"Fish", "dm-fish-upright,dm-fish-downleft"},
      {"Walker1", "dm-walker-squat,dm-walker-stand"},
      {"Walker2", "dm-walker-walk,dm-walker-backward"}};
  ASSERT_EQ(PairRegistry().size(), expected.size());
  for (const auto& [name, tasks] : expected) {
    const std::vector<std::string> ids = SplitTasks(name);
    EXPECT_EQ(JoinTasks(ids), tasks) << name;
    EXPECT_EQ(TasksName(ids), name);
    EXPECT_EQ(TasksName({ids.at(1), ids.at(0)}), ids[1] + "," + ids[0]) << "another run";
  }
}

TEST(EnvRegistry, AnUnknownTaskIsAnsweredWithTheNearestKnownOnes) {
  try {
    MakeEnv("Hoper-v2", EnvOptions{});
    FAIL() << "no error";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("unknown task 'Hoper-v2'; nearest: 'Hopper-v2'"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace o2v
