// The rules of the single gym tasks: ends, noise, rewards' oddities. Sizes are in registry_test.cc;
// values beside the reference's in tests/parity.

#include <gtest/gtest.h>

#include <cmath>

#include "env/task_helpers.h"

namespace o2v {
namespace {

// ---- Ends. States within 0.02 of an edge on both sides; the rule is applied to the state after
// the step, which must have come within 1e-3 of the edge on both sides for the test to mean
// anything.

struct Edge {
  std::string task;
  int index;        // of qpos
  double value;     // where the rule changes
  bool ends_above;  // the episode ends above (or below) the edge
};

class Ends : public testing::TestWithParam<Edge> {};

TEST_P(Ends, ExactlyBeyondTheEdge) {
  const Edge edge = GetParam();
  TaskUnderTest task(edge.task);
  LetFloat(task);
  double nearest_below = 1, nearest_above = 1;
  for (int i = 0; i < 400; ++i) {
    std::vector<double> qpos = task.Qpos0();
    qpos[std::size_t(edge.index)] = edge.value + task.resets.Uniform(-0.02, 0.02);
    task.ResetTo(qpos, task.AtRest());
    const bool terminated = task.Step(task.NoAction()).terminated;
    const double beyond = task.env->qpos()[std::size_t(edge.index)] - edge.value;
    EXPECT_EQ(terminated, edge.ends_above ? beyond > 0 : beyond < 0) << "at " << beyond;
    double& nearest = beyond > 0 ? nearest_above : nearest_below;
    nearest = std::min(nearest, std::abs(beyond));
  }
  EXPECT_LT(nearest_below, 1e-3);
  EXPECT_LT(nearest_above, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(
    Edges, Ends,
    testing::Values(Edge{"Hopper-v2", 1, 0.7, false}, Edge{"Hopper-v2", 2, 0.2, true},
                    Edge{"Hopper-v2", 2, -0.2, false}, Edge{"Walker2d-v2", 1, 0.8, false},
                    Edge{"Walker2d-v2", 1, 2.0, true}, Edge{"Walker2d-v2", 2, 1, true},
                    Edge{"Walker2d-v2", 2, -1, false}, Edge{"Ant-v2", 2, 0.2, false},
                    Edge{"Ant-v2", 2, 1.0, true}, Edge{"Humanoid-v2", 2, 1.0, false},
                    Edge{"Humanoid-v2", 2, 2.0, true}, Edge{"InvertedPendulum-v2", 1, 0.2, true},
                    Edge{"InvertedPendulum-v2", 1, -0.2, false}),
    [](const auto& info) {
      return TestName(info.param.task) + "Qpos" + std::to_string(info.param.index) +
             (info.param.ends_above ? "Above" : "Below") + std::to_string(info.index);
    });

TEST(Hopper, EndsWhenAVelocityOrAnAngleIsLarge) {
  TaskUnderTest task("Hopper-v2");
  std::vector<double> qvel = task.AtRest();
  task.ResetTo(task.Qpos0(), qvel);
  EXPECT_FALSE(task.Step({0, 0, 0}).terminated);
  qvel[0] = 150;  // [m/s], the first velocity is state[6]
  task.ResetTo(task.Qpos0(), qvel);
  EXPECT_TRUE(task.Step({0, 0, 0}).terminated);
  std::vector<double> qpos = task.Qpos0();
  qpos[0] = 150;  // state[0], the way run so far, may be large
  task.ResetTo(qpos, task.AtRest());
  EXPECT_FALSE(task.Step({0, 0, 0}).terminated);
}

TEST(InvertedDoublePendulum, EndsWhenTheTipIsAtOneMetreOrLower) {
  TaskUnderTest task("InvertedDoublePendulum-v2");
  LetFloat(task);
  const int tip = mj_name2id(&task.env->model(), mjOBJ_SITE, "tip");
  double nearest_below = 1, nearest_above = 1;
  for (int i = 0; i < 400; ++i) {
    // Both poles are 0.6 m long: straight and tilted by acos(1 / 1.2) the tip is at 1 m.
    const double tilt = std::acos(1 / 1.2) + task.resets.Uniform(-0.02, 0.02);
    task.ResetTo({0, tilt, 0}, task.AtRest());
    const bool terminated = task.Step({0}).terminated;
    const double beyond = task.env->data().site_xpos[3 * tip + 2] - 1;
    EXPECT_EQ(terminated, beyond <= 0) << "at " << beyond;
    double& nearest = beyond > 0 ? nearest_above : nearest_below;
    nearest = std::min(nearest, std::abs(beyond));
  }
  EXPECT_LT(nearest_below, 1e-3);
  EXPECT_LT(nearest_above, 1e-3);
}

class NeverEnds : public testing::TestWithParam<std::string> {};

TEST_P(NeverEnds, WhateverHappens) {
  TaskUnderTest task(GetParam());
  task.Reset();
  for (int step = 0; step < 300; ++step) ASSERT_FALSE(task.StepAtRandom().terminated);
}

INSTANTIATE_TEST_SUITE_P(Tasks, NeverEnds,
                         testing::Values("HalfCheetah-v2", "Swimmer-v2", "Reacher-v2",
                                         "HumanoidStandup-v2"),
                         [](const auto& info) { return TestName(info.param); });

// ---- Reset noise: drawn for qpos entry after entry, then for qvel.

struct Noise {
  std::string task;
  double qpos;  // bound of the uniform noise
  double qvel;  // the same, or the scale of the normal one
  bool normal = false;
  std::size_t nq = 0;  // entries compared, from the front: a quaternion is normalised; 0 = all
};

void PrintTo(const Noise& noise, std::ostream* out) { *out << noise.task; }

class ResetNoise : public testing::TestWithParam<Noise> {};

TEST_P(ResetNoise, IsDrawnInTheOrderOfTheState) {
  constexpr double kRounding = 1e-15;  // a compiler may fuse the multiplication and the addition
  const Noise noise = GetParam();
  TaskUnderTest task(noise.task);
  Rng expected(1, "resets");
  for (int episode = 0; episode < 20; ++episode) {
    task.Reset();
    const std::vector<double> qpos0 = task.Qpos0(), qpos = task.Qpos(), qvel = task.Qvel();
    for (std::size_t i = 0; i < qpos.size(); ++i) {
      const double want = qpos0[i] + expected.Uniform(-noise.qpos, noise.qpos);
      if (noise.nq == 0 || i < noise.nq) {
        EXPECT_NEAR(qpos[i], want, kRounding) << "qpos" << i;
      }
    }
    for (std::size_t i = 0; i < qvel.size(); ++i) {
      const double want =
          noise.normal ? noise.qvel * expected.Normal() : expected.Uniform(-noise.qvel, noise.qvel);
      EXPECT_NEAR(qvel[i], want, kRounding) << "qvel" << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Tasks, ResetNoise,
    testing::Values(Noise{"HalfCheetah-v2", 0.1, 0.1, true}, Noise{"Ant-v2", 0.1, 0.1, true, 3},
                    Noise{"Hopper-v2", 0.005, 0.005}, Noise{"Walker2d-v2", 0.005, 0.005},
                    Noise{"Swimmer-v2", 0.1, 0.1}, Noise{"Humanoid-v2", 0.01, 0.01, false, 3},
                    Noise{"HumanoidStandup-v2", 0.01, 0.01, false, 3},
                    Noise{"InvertedPendulum-v2", 0.01, 0.01},
                    Noise{"InvertedDoublePendulum-v2", 0.1, 0.1, true}),
    [](const auto& info) { return TestName(info.param.task); });

TEST(Reacher, TargetsFillTheDiscAndRest) {
  TaskUnderTest task("Reacher-v2");
  double largest_radius = 0, mean_square = 0;
  constexpr int kResets = 4000;
  for (int episode = 0; episode < kResets; ++episode) {
    task.Reset();
    const std::vector<double> qpos = task.Qpos(), qvel = task.Qvel();
    const double radius = std::hypot(qpos[2], qpos[3]);
    largest_radius = std::max(largest_radius, radius);
    mean_square += radius * radius / kResets;
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_LE(std::abs(qpos[i]), 0.1);
      EXPECT_LE(std::abs(qvel[i]), 0.005);
      EXPECT_EQ(qvel[i + 2], 0);
    }
  }
  EXPECT_LT(largest_radius, 0.2);
  EXPECT_GT(largest_radius, 0.199);
  // Uniform in a disc: E r^2 = R^2 / 2 = 0.02, std of r^2 is R^2 / sqrt(12); 5 sigma of the mean.
  EXPECT_NEAR(mean_square, 0.02, 5 * 0.04 / std::sqrt(12.0 * kResets));
}

// ---- Rewards read positions as stale as the reference's: those of the last substep's start.

TEST(Ant, SpeedIsMeasuredBetweenStalePositions) {
  TaskUnderTest task("Ant-v2");
  task.Reset();
  task.StepAtRandom();
  double before = task.Xpos("torso", 0);
  EXPECT_NE(before, task.env->qpos()[0]);
  for (int step = 0; step < 10; ++step) {
    const double reward = task.Step(task.NoAction()).reward;
    const double after = task.Xpos("torso", 0);
    EXPECT_NEAR(reward, (after - before) / 0.05 + 1, 1e-12);  // dt = 5 x 0.01 s
    before = after;
  }
}

TEST(Humanoid, SpeedIsThatOfTheStaleCentreOfMass) {
  TaskUnderTest task("Humanoid-v2");
  const mjModel& m = task.env->model();
  const auto centre = [&] {
    double mass = 0, moment = 0;
    for (int i = 1; i < m.nbody; ++i) {
      mass += m.body_mass[i];
      moment += m.body_mass[i] * task.env->data().xipos[3 * i];
    }
    return moment / mass;
  };
  task.Reset();
  task.StepAtRandom();
  double before = centre();
  for (int step = 0; step < 10; ++step) {
    const double reward = task.Step(task.NoAction()).reward;
    EXPECT_NEAR(reward, 1.25 * (centre() - before) / 0.015 + 5, 1e-11);  // dt = 5 x 0.003 s
    before = centre();
  }
}

TEST(Reacher, RewardIsTheDistanceBeforeTheStep) {
  TaskUnderTest task("Reacher-v2");
  task.Reset();
  for (int step = 0; step < 10; ++step) {
    const double distance = std::hypot(task.obs[8], task.obs[9], task.obs[10]);
    EXPECT_NEAR(task.Step({0.5, -1}).reward, -distance - (0.25 + 1), 1e-14);
  }
}

TEST(HumanoidStandup, HeightIsDividedByThePhysicsTimestep) {
  TaskUnderTest task("HumanoidStandup-v2");
  task.Reset();
  const double reward = task.Step(task.NoAction()).reward;
  EXPECT_NEAR(reward, task.env->qpos()[2] / 0.003 + 1, 1e-11);
}

TEST(Observations, ClipVelocitiesAtTen) {
  for (const auto& [id, first] : {std::pair{"Hopper-v2", 5},  // entry of the first velocity
                                  {"Walker2d-v2", 8},
                                  {"InvertedDoublePendulum-v2", 5}}) {
    TaskUnderTest task(id);
    std::vector<double> qvel = task.AtRest();
    qvel[0] = 50;
    qvel[1] = -50;
    task.ResetTo(task.Qpos0(), qvel);
    EXPECT_EQ(task.obs[std::size_t(first)], 10) << id;
    EXPECT_EQ(task.obs[std::size_t(first) + 1], -10) << id;
  }
}

}  // namespace
}  // namespace o2v
