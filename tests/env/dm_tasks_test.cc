// The rules of the DeepMind Control tasks: rewards, initial states, stepping. Sizes are in
// registry_test.cc; values beside the reference's in tests/parity.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "env/task_helpers.h"

namespace o2v {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRounding = 1e-12;  // of some steps of physics

std::vector<std::string> DmTasks() {
  std::vector<std::string> ids = AllTasks();
  std::erase_if(ids, [](const std::string& id) { return !id.starts_with("dm-"); });
  return ids;
}

class EveryDmTask : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, EveryDmTask, testing::ValuesIn(DmTasks()),
                         [](const auto& info) { return TestName(info.param); });

// ---- Rewards.

TEST_P(EveryDmTask, RewardsLieBetweenZeroAndOneAndItNeverTerminates) {
  TaskUnderTest task(GetParam());
  Rng states(1, "states");
  // [m/s, rad/s]. The fish's water is so dense that its motion diverges at 1 m/s.
  const double speed = GetParam().starts_with("dm-fish") ? 0.05 : 1;
  double least = 1, most = 0;
  for (int i = 0; i < 300; ++i) {
    task.Reset();
    std::vector<double> qpos = task.Qpos(), qvel = task.Qvel();
    for (double& q : qpos) q += states.Uniform(-0.3, 0.3);
    for (double& v : qvel) v += speed * states.Normal();
    task.ResetTo(qpos, qvel);
    const StepResult result = task.StepAtRandom();
    ASSERT_GE(result.reward, 0);
    ASSERT_LE(result.reward, 1);
    ASSERT_FALSE(result.terminated);
    least = std::min(least, result.reward);
    most = std::max(most, result.reward);
  }
  EXPECT_LT(least + 0.1, most);
}

// Reward of a step without control from a state that does not change in it but by its velocity:
// nothing acts on the body.
double RewardAt(TaskUnderTest& task, const std::vector<double>& qpos,
                const std::vector<double>& qvel) {
  LetFloat(task);
  task.ResetTo(qpos, qvel);
  return task.Step(task.NoAction()).reward;
}

double RewardAt(TaskUnderTest& task, const std::vector<double>& qpos) {
  return RewardAt(task, qpos, task.AtRest());
}

TEST(DmCartpoleBalance, RewardIsHighestUprightInTheMiddleAtRest) {
  TaskUnderTest task("dm-cartpole-balance");
  EXPECT_EQ(RewardAt(task, {0, 0}), 1);
  EXPECT_NEAR(RewardAt(task, {0, kPi / 2}), 0.5, kRounding);    // (0 + 1) / 2
  EXPECT_NEAR(RewardAt(task, {0, kPi}), 0, kRounding);          // (-1 + 1) / 2
  EXPECT_NEAR(RewardAt(task, {-2, 0}), 0.55, kRounding);        // (1 + 0.1) / 2, at the margin
  EXPECT_NEAR(RewardAt(task, {2, kPi / 2}), 0.275, kRounding);  // both
}

TEST(DmCartpoleBalance, RewardFallsWithControlAndVelocity) {
  TaskUnderTest task("dm-cartpole-balance");
  for (const double a : {-1.0, -0.5, 0.0, 0.2, 1.0}) {
    task.ResetTo({0.5, 0.3}, {0.1, 4});
    const double reward = task.Step({a}).reward;
    const double x = task.obs[0], cos = task.obs[1], velocity = task.obs[4];
    EXPECT_NEAR(reward,
                (cos + 1) / 2 * (5 - a * a) / 5 * (1 + std::pow(0.1, velocity * velocity / 25)) /
                    2 * (1 + std::pow(0.1, x * x / 4)) / 2,
                kRounding);
  }
}

TEST(DmCartpoleBalanceSparse, RewardIsOneInsideBothBounds) {
  TaskUnderTest task("dm-cartpole-balance_sparse");
  const double angle = std::acos(0.995);
  EXPECT_EQ(RewardAt(task, {0, 0}), 1);
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_EQ(RewardAt(task, {sign * 0.25, sign * (angle - 1e-9)}), 1);
    EXPECT_EQ(RewardAt(task, {sign * (0.25 + 1e-9), 0}), 0);
    EXPECT_EQ(RewardAt(task, {0, sign * (angle + 1e-9)}), 0);
  }
  EXPECT_EQ(RewardAt(task, {0, kPi}), 0);
}

TEST(DmCartpole, ObservesCosineAndSineOfTheAngle) {
  TaskUnderTest task("dm-cartpole-balance");
  task.ResetTo({0.1, 0.4}, {0.2, -0.3});
  const std::vector<double> expected = {0.1, std::cos(0.4), std::sin(0.4), 0.2, -0.3};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(task.obs[i], expected[i], 1e-15) << i;
}

TEST(DmReacher, RewardIsOneWhileFingerAndTargetTouch) {
  // Stretched along x the arm's finger, of radius 0.01, is at (0.12 + 0.12, 0).
  for (const auto& [id, reach] :
       {std::pair{"dm-reacher-easy", 0.05 + 0.01}, std::pair{"dm-reacher-hard", 0.015 + 0.01}}) {
    TaskUnderTest task(id);
    for (const double direction : {0.0, 2.0, 4.0}) {
      for (const double beyond : {-1e-9, 1e-9}) {
        task.env->Target()[0] = 0.24 + (reach + beyond) * std::cos(direction);
        task.env->Target()[1] = (reach + beyond) * std::sin(direction);
        EXPECT_EQ(RewardAt(task, {0, 0}), beyond < 0) << id;
      }
    }
  }
}

TEST(DmReacher, ObservesTheWayFromFingerToTarget) {
  TaskUnderTest task("dm-reacher-easy");
  task.env->Target()[0] = 0.05;
  task.env->Target()[1] = -0.07;
  task.ResetTo({kPi / 2, -kPi / 2}, {1, -2});  // upper arm along y, hand along x
  const std::vector<double> expected = {kPi / 2, -kPi / 2, 0.05 - 0.12, -0.07 - 0.12, 1, -2};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(task.obs[i], expected[i], 1e-15) << i;
}

TEST(DmCheetah, RewardIsATenthOfTheSpeedInTheTasksDirection) {
  TaskUnderTest run("dm-cheetah-run"), backward("dm-cheetah-backward");
  std::vector<double> qvel = run.AtRest();
  for (const auto& [speed, reward] :
       {std::pair{-12.0, 0.0}, {-3.0, 0.0}, {0.0, 0.0}, {3.0, 0.3}, {10.0, 1.0}, {12.0, 1.0}}) {
    qvel[0] = speed;
    EXPECT_NEAR(RewardAt(run, run.Qpos0(), qvel), reward, kRounding) << speed;
    qvel[0] = -speed;
    EXPECT_NEAR(RewardAt(backward, run.Qpos0(), qvel), reward, kRounding) << -speed;
  }
}

TEST(DmCheetah, SpeedIsThatOfTheWholeBody) {
  // Torso at rest, front thigh turning forward: the centre of mass moves, the torso's frame not.
  TaskUnderTest task("dm-cheetah-run");
  std::vector<double> qvel = task.AtRest();
  qvel[6] = -20;  // [rad/s]
  EXPECT_GT(RewardAt(task, task.Qpos0(), qvel), 0.01);
}

TEST(DmFish, RewardIsGaussianInUp) {
  TaskUnderTest upright("dm-fish-upright"), downleft("dm-fish-downleft");
  const auto turned = [&](double angle) {  // about x
    std::vector<double> qpos = upright.Qpos0();
    qpos[3] = std::cos(angle / 2);
    qpos[4] = std::sin(angle / 2);
    return qpos;
  };
  for (const auto& [angle, up_reward, down_reward] :
       {std::tuple{0.0, 1.0, 1e-4},  // distances 0 and 2: 0.1^0, 0.1^4
        {kPi, 1e-4, 1.0},            // 2 and 0
        {kPi / 2, 0.1, 0.1},         // 1 and 1
        {kPi / 3, 0.56234132519034908, 0.0056234132519034908}}) {  // 1/2, 3/2: 0.1^0.25, 0.1^2.25
    EXPECT_NEAR(RewardAt(upright, turned(angle)), up_reward, kRounding) << angle;
    EXPECT_NEAR(RewardAt(downleft, turned(angle)), down_reward, kRounding) << angle;
    EXPECT_NEAR(upright.obs[7], std::cos(angle), kRounding) << angle;
  }
}

// The walker's torso, straight above its stretched legs, at a height [m] and turned by an angle.
std::vector<double> WalkerAt(const TaskUnderTest& task, double height, double angle = 0) {
  std::vector<double> qpos = task.Qpos0();
  qpos[0] = height - 1.3;
  qpos[2] = angle;
  return qpos;
}

TEST(DmWalker, StandingCountsThreePartsHeightAndOnePartUprightness) {
  TaskUnderTest squat("dm-walker-squat"), stand("dm-walker-stand");
  struct Case {
    double height, angle, squat, stand;
  };
  for (const Case& c : {
           Case{1.3, 0, 1, 1},
           {1.3, kPi, 0.75, 0.75},        // upside down: (3 + 0) / 4
           {1.3, kPi / 2, 0.875, 0.875},  // (3 + 1/2) / 4
           // Squat: inside. Stand: 0.6 below 1.2, at the margin: (3 * 0.1 + 1) / 4.
           {0.6 + 1e-9, 0, 1, 0.325},
           // Squat: 0.3 below 0.6, at the margin. Stand: d = 3/2, (3 * 0.1^2.25 + 1) / 4.
           {0.3, 0, 0.325, 0.2542175599389276},
           {0.3, kPi, 0.075, 0.0042175599389276},  // fallen: (3 * 0.1 + 0) / 4
       }) {
    EXPECT_NEAR(RewardAt(squat, WalkerAt(squat, c.height, c.angle)), c.squat, 1e-8) << c.height;
    EXPECT_NEAR(RewardAt(stand, WalkerAt(stand, c.height, c.angle)), c.stand, 1e-8) << c.height;
  }
}

TEST(DmWalker, WalkingMultipliesStandingByASpeedFactor) {
  TaskUnderTest walk("dm-walker-walk"), backward("dm-walker-backward");
  std::vector<double> qvel = walk.AtRest();
  // (5 m + 1) / 6 with m = 1 - (1 - speed) for speeds of 0 to 1 m/s.
  for (const auto& [speed, factor] : {std::pair{-1.0, 1 / 6.0},
                                      {0.0, 1 / 6.0},
                                      {0.25, 2.25 / 6},
                                      {0.5, 3.5 / 6},
                                      {1.0, 1.0},
                                      {3.0, 1.0}}) {
    for (const auto& [height, stand] : {std::pair{1.3, 1.0}, {0.6, 0.325}}) {
      qvel[1] = speed;
      EXPECT_NEAR(RewardAt(walk, WalkerAt(walk, height), qvel), stand * factor, kRounding) << speed;
      qvel[1] = -speed;
      EXPECT_NEAR(RewardAt(backward, WalkerAt(walk, height), qvel), stand * factor, kRounding)
          << -speed;
    }
  }
}

TEST(DmWalker, ObservesTheDirectionOfEveryBody) {
  TaskUnderTest task("dm-walker-walk");
  std::vector<double> qpos = WalkerAt(task, 1.5, 0.3), qvel = task.AtRest();
  qpos[3] = 0.2;  // right hip, whose axis is opposite to the torso's
  qvel[8] = 7;
  task.ResetTo(qpos, qvel);
  for (std::size_t body = 0; body < 7; ++body) {
    const bool right_leg = 1 <= body && body <= 3;
    const double angle = right_leg ? 0.3 - 0.2 : 0.3;
    EXPECT_NEAR(task.obs[2 * body], std::cos(angle), kRounding) << body;
    EXPECT_NEAR(task.obs[2 * body + 1], std::sin(angle), kRounding) << body;
  }
  EXPECT_NEAR(task.obs[14], 1.5, kRounding);
  EXPECT_EQ(task.obs[23], 7);
}

// ---- Initial states.

TEST(DmCartpole, NoiseIsDrawnInTheOrderOfTheState) {
  TaskUnderTest task("dm-cartpole-balance");
  Rng expected(1, "resets");
  for (int episode = 0; episode < 20; ++episode) {
    task.Reset();
    EXPECT_NEAR(task.Qpos()[0], expected.Uniform(-0.1, 0.1), 1e-15);
    EXPECT_NEAR(task.Qpos()[1], expected.Uniform(-0.034, 0.034), 1e-15);
    EXPECT_NEAR(task.Qvel()[0], 0.01 * expected.Normal(), 1e-15);
    EXPECT_NEAR(task.Qvel()[1], 0.01 * expected.Normal(), 1e-15);
  }
}

/// Least, largest, sum and sum of squares of what it is shown.
struct Range {
  double least = INFINITY, most = -INFINITY, sum = 0, squares = 0;
  int n = 0;
  void Add(double x) {
    least = std::min(least, x);
    most = std::max(most, x);
    sum += x;
    squares += x * x;
    ++n;
  }
};

// Of 4000 draws the extremes lie within 1 % of the ends, and two means within 5 sigma: that of the
// draws of the middle (sigma width / sqrt(12 * 4000)), that of the squares about the middle of
// width^2 / 12 (sigma width^2 / sqrt(180 * 4000)). One seed in a million fails.
constexpr int kResets = 4000;
void ExpectUniform(const Range& x, double low, double high, const std::string& what) {
  const double width = high - low;
  EXPECT_GE(x.least, low) << what;
  EXPECT_LE(x.most, high) << what;
  EXPECT_LT(x.least, low + 0.01 * width) << what;
  EXPECT_GT(x.most, high - 0.01 * width) << what;
  const double middle = (low + high) / 2, mean = x.sum / x.n;
  EXPECT_NEAR(mean, middle, 5 * width / std::sqrt(12.0 * kResets)) << what;
  EXPECT_NEAR(x.squares / x.n - 2 * middle * mean + middle * middle, width * width / 12,
              5 * width * width / std::sqrt(180.0 * kResets))
      << what;
}

TEST(DmReacher, JointsFillTheirRangesAndTargetsARing) {
  TaskUnderTest task("dm-reacher-hard");
  Range shoulder, wrist, radius, angle;
  for (int episode = 0; episode < kResets; ++episode) {
    task.Reset();
    const double x = task.env->Target()[0], y = task.env->Target()[1];
    shoulder.Add(task.Qpos()[0]);
    wrist.Add(task.Qpos()[1]);
    radius.Add(std::hypot(x, y));
    angle.Add(std::atan2(x, y));
    EXPECT_EQ(task.Qvel(), task.AtRest());
  }
  ExpectUniform(shoulder, -kPi, kPi, "shoulder");
  ExpectUniform(wrist, -2.7925268031909272, 2.7925268031909272, "wrist");  // 160 degrees
  ExpectUniform(radius, 0.05, 0.2, "radius");
  ExpectUniform(angle, -kPi, kPi, "angle");
}

TEST(DmFish, OrientationsAreUniformAndJointsNearlyStraight) {
  TaskUnderTest task("dm-fish-upright");
  Range up, joints[7];
  for (int episode = 0; episode < kResets; ++episode) {
    task.Reset();
    const std::vector<double> qpos = task.Qpos();
    EXPECT_NEAR(SquaredNorm(std::span(qpos).subspan(3, 4)), 1, 1e-14);
    up.Add(task.obs[7]);  // of a uniform rotation U(-1, 1)
    for (std::size_t i = 0; i < 7; ++i) joints[i].Add(qpos[7 + i]);
    EXPECT_EQ(task.Qvel(), task.AtRest());
    EXPECT_EQ(qpos[0], 0);
    EXPECT_EQ(qpos[1], 0);
    EXPECT_EQ(qpos[2], 0.1);
  }
  ExpectUniform(up, -1, 1, "up");
  for (const Range& joint : joints) ExpectUniform(joint, -0.2, 0.2, "joint");
}

TEST(DmWalker, JointsFillTheirRangesAndTheTorsoTurnsAllAround) {
  TaskUnderTest task("dm-walker-stand");
  Range joints[9];
  for (int episode = 0; episode < kResets; ++episode) {
    task.Reset();
    for (std::size_t i = 0; i < 9; ++i) joints[i].Add(task.Qpos()[i]);
    EXPECT_EQ(task.Qvel(), task.AtRest());
  }
  for (const std::size_t root : {0, 1}) {
    EXPECT_EQ(joints[root].least, 0);
    EXPECT_EQ(joints[root].most, 0);
  }
  ExpectUniform(joints[2], -kPi, kPi, "torso");
  for (const std::size_t hip : {3, 6}) {  // -20 to 100, -150 to 0, -45 to 45 degrees
    ExpectUniform(joints[hip], -kPi / 9, kPi / 1.8, "hip");
    ExpectUniform(joints[hip + 1], -kPi / 1.2, 0, "knee");
    ExpectUniform(joints[hip + 2], -kPi / 4, kPi / 4, "ankle");
  }
}

TEST(DmCheetah, AnEpisodeStartsWhenTheBodyHasSettledFor200Steps) {
  TaskUnderTest task("dm-cheetah-run"), by_hand("dm-cheetah-run");
  Rng expected(1, "resets");
  const mjModel& m = by_hand.env->model();
  mjData& d = by_hand.env->data();
  for (int episode = 0; episode < 3; ++episode) {
    task.Reset();
    mj_resetData(&m, &d);
    for (int joint = 3; joint < 9; ++joint) {  // the limited ones
      d.qpos[joint] = expected.Uniform(m.jnt_range[2 * joint], m.jnt_range[2 * joint + 1]);
    }
    for (int i = 0; i < 200; ++i) mj_step(&m, &d);
    for (std::size_t i = 0; i < 9; ++i) {
      EXPECT_NEAR(task.Qpos()[i], by_hand.Qpos()[i], 1e-9) << i;
      EXPECT_NEAR(task.Qvel()[i], by_hand.Qvel()[i], 1e-9) << i;
    }
    EXPECT_EQ(task.env->data().time, 0);
    task.StepAtRandom();
    EXPECT_NEAR(task.env->data().time, 0.01, 1e-15);  // of the episode, not of 201 steps
  }
}

// ---- Stepping.

TEST_P(EveryDmTask, AStepIsNPhysicsStepsAndLeavesDerivedQuantitiesUpToDate) {
  TaskUnderTest task(GetParam()), by_hand(GetParam());
  const mjModel& m = by_hand.env->model();
  mjData& d = by_hand.env->data();
  const bool ten = GetParam().starts_with("dm-fish") || GetParam().starts_with("dm-walker");
  const int n = ten ? 10 : 1;  // spec E.3
  task.Reset();
  by_hand.Reset();
  for (int step = 0; step < 10; ++step) {
    const std::vector<double> a = task.Action();
    task.Step(a);
    std::ranges::copy(a, d.ctrl);
    for (int i = 0; i < n; ++i) mj_step(&m, &d);
    mj_forward(&m, &d);
    const mjData& ours = task.env->data();
    const auto expect_near = [&](const double* x, const double* y, int size, const char* what) {
      for (int i = 0; i < size; ++i) {
        ASSERT_NEAR(x[i], y[i], 1e-9 * std::max(1.0, std::abs(y[i])))
            << what << " " << i << ", step " << step;
      }
    };
    expect_near(ours.qpos, d.qpos, m.nq, "qpos");
    expect_near(ours.qvel, d.qvel, m.nv, "qvel");
    expect_near(ours.xpos, d.xpos, 3 * m.nbody, "xpos");
    expect_near(ours.xmat, d.xmat, 9 * m.nbody, "xmat");
    expect_near(ours.sensordata, d.sensordata, m.nsensordata, "sensordata");
    EXPECT_NEAR(ours.time, (step + 1) * n * m.opt.timestep, 1e-12);
  }
}

}  // namespace
}  // namespace o2v
