// What all tasks have in common: reset, resumption, time limit, divergence.

#include "env/mujoco_env.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <utility>

#include "base/check.h"
#include "env/task_helpers.h"

namespace o2v {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// ---- For every task.

class EveryTask : public testing::TestWithParam<std::string> {
 protected:
  // Fast motion, in contact where the model has contacts: full controls of random signs.
  static void Dirty(TaskUnderTest& task) {
    task.Reset();
    for (int step = 0; step < 200; ++step) {
      std::vector<double> a = task.Action();
      for (std::size_t i = 0; i < a.size(); ++i) {
        a[i] = a[i] > 0 ? task.env->Spec().a_high[i] : task.env->Spec().a_low[i];
      }
      task.Step(a);
    }
  }
};

TEST_P(EveryTask, AResetLeavesNoTraceOfTheStateBefore) {
  for (const bool contact_forces : {false, true}) {
    TaskUnderTest fast(GetParam(), contact_forces), slow(GetParam(), contact_forces);
    Dirty(fast);
    Dirty(slow);
    slow.env->data().ctrl[0] = kNaN;  // something that only a reset removes
    mj_resetData(&slow.env->model(), &slow.env->data());
    fast.Reset();
    slow.Reset();
    ASSERT_EQ(Bytes(fast, {}), Bytes(slow, {})) << "at the reset";
    for (int step = 0; step < 1000; ++step) {
      const StepResult a = fast.StepAtRandom(), b = slow.StepAtRandom();
      ASSERT_EQ(Bytes(fast, a), Bytes(slow, b)) << "step " << step;
    }
  }
}

// Plays on, an episode after the other, as a rollout does.
std::string Play(TaskUnderTest& task, int steps) {
  std::string bytes;
  for (int step = 0; step < steps; ++step) {
    const StepResult result = task.StepAtRandom();
    bytes += Bytes(task, result);
    if (result.terminated || result.truncated) task.Reset();
  }
  return bytes;
}

TEST_P(EveryTask, SavingChangesNothing) {
  TaskUnderTest saved(GetParam()), untouched(GetParam());
  for (TaskUnderTest* task : {&saved, &untouched}) {
    task->Reset();
    Play(*task, 37);
  }
  SavingVisitor visitor;
  saved.env->Serialize(visitor, "worker0.");
  EXPECT_TRUE(Play(saved, 300) == Play(untouched, 300));
}

TEST_P(EveryTask, ALoadedStateGoesOnAsTheSavedOne) {
  constexpr int kLimit = 300;  // [steps], so that the running episode's steps matter
  TaskUnderTest saved(GetParam(), false, kLimit), loaded(GetParam(), false, kLimit);
  saved.Reset();
  Play(saved, 37);
  // Where the model has constraints one is active, so that qacc_warmstart matters.
  for (int i = 0; i < 200 && saved.env->data().nefc == 0; ++i) Play(saved, 1);
  for (int episode = 0; episode < 2; ++episode) loaded.Reset();  // another one than the saved one
  SavingVisitor visitor;
  saved.env->Serialize(visitor, "worker0.");
  LoadingVisitor loading(visitor);
  loaded.env->Serialize(loading, "worker0.");
  loaded.resets = saved.resets;
  loaded.actions = saved.actions;
  EXPECT_TRUE(Play(saved, 1000) == Play(loaded, 1000));
}

TEST_P(EveryTask, TheTimeLimitTruncatesAndAResetStartsItAnew) {
  TaskUnderTest task(GetParam(), false, /*time_limit=*/3);
  for (int episode = 0; episode < 2; ++episode) {
    task.Reset();
    EXPECT_FALSE(task.StepAtRandom().truncated);
    EXPECT_FALSE(task.StepAtRandom().truncated);
    EXPECT_TRUE(task.StepAtRandom().truncated);
  }
}

TEST_P(EveryTask, WrongSizesAreRefused) {
  TaskUnderTest task(GetParam());
  task.Reset();
  std::vector<double> a = task.NoAction();
  a.push_back(0);
  EXPECT_THROW(task.Step(a), Error);
  task.obs.pop_back();
  EXPECT_THROW(task.Step(task.NoAction()), Error);
  EXPECT_THROW(task.ResetTo({0}, {0}), Error);
}

TEST_P(EveryTask, ANonFiniteActionIsReported) {
  TaskUnderTest task(GetParam());
  task.Reset();
  std::vector<double> a = task.NoAction();
  a[0] = kNaN;
  EXPECT_THROW(task.Step(a), DivergedError);
}

TEST_P(EveryTask, AStateThatTheSimulatorRepairsIsReported) {
  TaskUnderTest task(GetParam());
  std::vector<double> qvel = task.AtRest();
  qvel[0] = 1e12;  // above mjMAXVAL = 1e10
  task.ResetTo(task.Qpos0(), qvel);
  EXPECT_THROW(task.StepAtRandom(), DivergedError);
  task.Reset();
  EXPECT_NO_THROW(task.StepAtRandom());
}

INSTANTIATE_TEST_SUITE_P(All, EveryTask, testing::ValuesIn(AllTasks()),
                         [](const auto& info) { return TestName(info.param); });

// ---- Once.

std::string MessageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const DivergedError& error) {
    return error.what();
  }
  return "";
}

TEST(Divergence, NamesTaskStepAndWarning) {
  TaskUnderTest task("HalfCheetah-v2");
  task.Reset();
  task.StepAtRandom();
  task.env->data().qvel[4] = 1e12;
  const std::string message = MessageOf([&] { task.StepAtRandom(); });
  EXPECT_EQ(message, "HalfCheetah-v2: simulator warning BADQVEL (4) at step 2 of the episode");
}

TEST(Divergence, OfPositionAndAccelerationIsNamedToo) {
  TaskUnderTest task("HalfCheetah-v2");
  task.Reset();
  task.env->data().qpos[1] = kNaN;
  EXPECT_NE(MessageOf([&] { task.StepAtRandom(); }).find("BADQPOS"), std::string::npos);
  task.Reset();
  task.env->data().qfrc_applied[3] = 1e14;  // [N m]
  EXPECT_NE(MessageOf([&] { task.StepAtRandom(); }).find("BADQACC"), std::string::npos);
}

TEST(Divergence, EveryWarningOfAChangedStateIsOne) {
  // What the simulator repairs or drops by itself; it goes on counting where it finds a number.
  for (const auto& [type, name] : {std::pair{mjWARN_INERTIA, "INERTIA"},
                                   {mjWARN_CONTACTFULL, "CONTACTFULL"},
                                   {mjWARN_CNSTRFULL, "CNSTRFULL"},
                                   {mjWARN_BADQPOS, "BADQPOS"},
                                   {mjWARN_BADQVEL, "BADQVEL"},
                                   {mjWARN_BADQACC, "BADQACC"},
                                   {mjWARN_BADCTRL, "BADCTRL"}}) {
    TaskUnderTest task("Hopper-v2");
    task.Reset();
    task.env->data().warning[type] = {/*lastinfo=*/7, /*number=*/1};
    EXPECT_EQ(MessageOf([&] { task.StepAtRandom(); }),
              Concat("Hopper-v2: simulator warning ", name, " (7) at step 1 of the episode"));
    task.Reset();  // forgets it
    EXPECT_EQ(MessageOf([&] { task.StepAtRandom(); }), "");
  }
}

TEST(Divergence, ANonFiniteResetIsReported) {
  TaskUnderTest task("Swimmer-v2");
  std::vector<double> qvel = task.AtRest();
  qvel[2] = kNaN;
  EXPECT_NE(MessageOf([&] { task.ResetTo(task.Qpos0(), qvel); }).find("non-finite observation 5"),
            std::string::npos);
}

TEST(Divergence, WritesNoLogFile) {
  TaskUnderTest task("HalfCheetah-v2");
  task.Reset();
  task.env->data().qpos[1] = kNaN;
  EXPECT_THROW(task.StepAtRandom(), DivergedError);
  EXPECT_FALSE(std::filesystem::exists("MUJOCO_LOG.TXT"));
}

TEST(MujocoErrors, PrintAndAbort) {
  TaskUnderTest task("Swimmer-v2");
  EXPECT_DEATH(mju_error("planted"), "MuJoCo: planted");
}

TEST(TimeLimit, AStepMayEndAnEpisodeForBothReasons) {
  TaskUnderTest task("InvertedPendulum-v2", false, /*time_limit=*/1);
  task.ResetTo({0, 0.3}, {0, 0});  // tilted by more than 0.2 rad
  const StepResult result = task.Step({0});
  EXPECT_TRUE(result.terminated);
  EXPECT_TRUE(result.truncated);
}

TEST(TimeLimit, MustBePositive) { EXPECT_THROW(TaskUnderTest("Swimmer-v2", false, -1), Error); }

TEST(ContactForces, AreZeroUnlessAskedFor) {
  // Humanoid standing up starts on its back: in contact from the first steps on.
  TaskUnderTest off("HumanoidStandup-v2"), on("HumanoidStandup-v2", true);
  double largest_off = 0, largest_on = 0;
  for (TaskUnderTest* task : {&off, &on}) {
    task->Reset();
    for (int step = 0; step < 20; ++step) task->Step(task->NoAction());
    double& largest = task == &off ? largest_off : largest_on;
    for (std::size_t i = 376 - 84; i < 376; ++i) {  // cfrc_ext is the last 14 x 6 of obs
      largest = std::max(largest, std::abs(task->obs[i]));
    }
  }
  EXPECT_EQ(largest_off, 0);
  EXPECT_GT(largest_on, 1);
}

TEST(ContactForces, CostWhatTheRewardSays) {
  TaskUnderTest off("Ant-v2"), on("Ant-v2", true);
  double difference = 0, expected = 0;
  off.Reset();
  on.Reset();
  for (int step = 0; step < 50; ++step) {
    difference += off.Step(off.NoAction()).reward - on.Step(on.NoAction()).reward;
    for (std::size_t i = 111 - 84; i < 111; ++i) {  // clipped in the observation already
      EXPECT_LE(std::abs(on.obs[i]), 1);
      expected += 0.5e-3 * on.obs[i] * on.obs[i];
    }
  }
  EXPECT_GT(expected, 1e-4);
  EXPECT_NEAR(difference, expected, 1e-12);
}

/// Sum of squares of the contact forces, the last 14 x 6 observations of a humanoid.
double SquaredForces(const TaskUnderTest& task) {
  return SquaredNorm(std::span(task.obs).last(84));
}

class HumanoidCosts : public testing::TestWithParam<std::string> {};

TEST_P(HumanoidCosts, OfContactAreTheSquaredForces) {
  // The same motion with and without forces: the rewards differ by the cost of contact alone.
  TaskUnderTest off(GetParam()), on(GetParam(), true);
  off.Reset();
  on.Reset();
  double largest = 0;
  for (int step = 0; step < 60; ++step) {
    const std::vector<double> a = on.Action();
    const double difference = off.Step(a).reward - on.Step(a).reward;
    const double cost = 0.5e-6 * SquaredForces(on);
    ASSERT_LT(cost, 10);
    EXPECT_NEAR(difference, cost, 1e-9) << step;
    largest = std::max(largest, cost);
  }
  EXPECT_GT(largest, 1e-3);
}

TEST_P(HumanoidCosts, OfContactAreAtMostTen) {
  TaskUnderTest off(GetParam()), on(GetParam(), true);
  std::vector<double> qpos = on.Qpos0(), qvel = on.AtRest();
  qvel[2] = -30;  // thrown at the floor [m/s]
  off.ResetTo(qpos, qvel);
  on.ResetTo(qpos, qvel);
  double most = 0;
  for (int step = 0; step < 20; ++step) {
    const double difference = off.Step(off.NoAction()).reward - on.Step(on.NoAction()).reward;
    const double cost = 0.5e-6 * SquaredForces(on);
    EXPECT_NEAR(difference, std::min(cost, 10.0), 1e-9) << step;
    most = std::max(most, cost);
  }
  EXPECT_GT(most, 20);
}

TEST_P(HumanoidCosts, OfControlAreATenthOfTheSquares) {
  // The same motion twice, since the motors have no force: 17 controls of +-0.4 cost
  // 0.1 x 17 x 0.16 = 0.272.
  TaskUnderTest task(GetParam());
  mjModel& m = task.env->model();
  std::fill_n(m.actuator_gear, 6 * m.nu, 0.0);  // motors without force
  std::vector<double> a = task.NoAction();
  task.ResetTo(task.Qpos0(), task.AtRest());
  const double idle = task.Step(a).reward;
  for (std::size_t i = 0; i < a.size(); ++i) a[i] = i % 2 ? 0.4 : -0.4;
  task.ResetTo(task.Qpos0(), task.AtRest());
  EXPECT_NEAR(idle - task.Step(a).reward, 0.272, 1e-10);
}

INSTANTIATE_TEST_SUITE_P(Tasks, HumanoidCosts, testing::Values("Humanoid-v2", "HumanoidStandup-v2"),
                         [](const auto& info) { return TestName(info.param); });

}  // namespace
}  // namespace o2v
