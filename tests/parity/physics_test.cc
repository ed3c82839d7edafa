// Every task's model, trajectory and step oracle within the bounds of spec E.5 and E.6.

#include <gtest/gtest.h>

#include "parity/physics_parity.h"

namespace o2v {
namespace {

void ExpectPass(const ParityRow& row) {
  EXPECT_LE(row.deviation, row.bound) << row.check << " of " << row.name << ": " << row.where;
}

// Of each model the first task: another one may have changed it (dm-reacher-hard's target).
TEST(ModelParity, EveryModelIsTheReferences) {
  std::vector<std::string> models;
  for (const EnvEntry& entry : EnvRegistry()) {
    const auto env = MakeMujocoEnv(entry.id);
    if (std::ranges::count(models, env->ModelName())) continue;
    models.push_back(env->ModelName());
    ExpectPass(ModelParity(*env, O2V_TEST_DATA));
  }
  EXPECT_EQ(models.size(), 15u);  // ten of gym, five of DeepMind Control
}

class PhysicsParity : public testing::TestWithParam<std::string> {
 protected:
  std::unique_ptr<MujocoEnv> env_ = MakeMujocoEnv(GetParam());
};

TEST_P(PhysicsParity, TheTrajectoryIsTheReferences) {
  ExpectPass(TrajectoryParity(*env_, O2V_TEST_DATA));
}

TEST_P(PhysicsParity, ObservationRewardAndEndAreTheReferences) {
  ExpectPass(StepParity(*env_, O2V_TEST_DATA));
}

std::vector<std::string> Tasks() {
  std::vector<std::string> ids;
  for (const EnvEntry& entry : EnvRegistry()) ids.push_back(entry.id);
  return ids;
}

INSTANTIATE_TEST_SUITE_P(All, PhysicsParity, testing::ValuesIn(Tasks()), [](const auto& info) {
  std::string name = info.param;
  std::erase_if(name, [](char c) { return c == '-' || c == '_'; });
  return name;
});

// The comparison itself: what it must find.

class DumpComparison : public testing::Test {
 protected:
  ModelDump::Json ours_ = ModelDump::Of(MakeMujocoEnv("Hopper-v2")->model());
  ModelDump::Json reference_ = ours_;
};

TEST_F(DumpComparison, EqualDumpsDoNotDeviate) {
  EXPECT_EQ(CompareDumps(ours_, reference_).value, 0);
}

TEST_F(DumpComparison, ARelativeErrorOfTwoBillionthsIsTwiceTheBound) {
  reference_["bodies"][2]["mass"] = ours_["bodies"][2]["mass"].get<double>() * (1 + 2e-9);
  const FieldDeviation d = CompareDumps(ours_, reference_);
  EXPECT_NEAR(d.value, 2, 1e-3);
  EXPECT_EQ(d.field, "/bodies/2/mass");
}

TEST_F(DumpComparison, AnIntegerMustBeEqual) {
  reference_["geoms"][0]["condim"] = 4;
  EXPECT_GT(CompareDumps(ours_, reference_).value, 1);
}

TEST_F(DumpComparison, ANameMustBeEqualUnlessTheReferenceHasNone) {
  reference_["bodies"][2]["name"] = "";
  EXPECT_EQ(CompareDumps(ours_, reference_).value, 0);
  reference_["bodies"][2]["name"] = "knee";
  EXPECT_GT(CompareDumps(ours_, reference_).value, 1);
}

TEST_F(DumpComparison, AMissingFieldOrObjectIsFound) {
  reference_["geoms"].erase(4);
  EXPECT_EQ(CompareDumps(ours_, reference_).field, "/geoms");
  ours_["option"].erase("wind");
  reference_ = ModelDump::Of(MakeMujocoEnv("Hopper-v2")->model());
  EXPECT_EQ(CompareDumps(ours_, reference_).field, "/option/wind");
}

TEST_F(DumpComparison, OnlyTheRangeOfALimitedJointCounts) {
  reference_["joints"][0]["range_rad_or_m"] = {-1, 1};
  EXPECT_EQ(CompareDumps(ours_, reference_).value, 0);
  reference_["joints"][3]["range_rad_or_m"] = {-1, 1};
  EXPECT_GT(CompareDumps(ours_, reference_).value, 1);
}

}  // namespace
}  // namespace o2v
