#include "rollout/vec_env.h"

#include <gtest/gtest.h>

#include "base/check.h"
#include "memory_visitor.h"

namespace o2v {
namespace {

/// A task whose course is known: obs = [100 episode + steps of it, noise of the reset], reward =
/// a_0. An episode ends after `length` steps, in the way that `terminated` and `truncated` say.
class ScriptedEnv final : public Env {
 public:
  ScriptedEnv(int length, bool terminated, bool truncated, std::vector<double>* last_action)
      : length_(length), terminated_(terminated), truncated_(truncated), last_action_(last_action) {
    spec_.id = "Scripted-v0";
    spec_.S = 2;
    spec_.A = 2;
    spec_.time_limit = length;
    spec_.a_low = {-1, -0.5};
    spec_.a_high = {1, 0.5};
  }

  const EnvSpec& Spec() const override { return spec_; }

  void Reset(Rng& rng, std::span<double> obs) override {
    ++episode_;
    steps_ = 0;
    noise_ = rng.Uniform();
    Observe(obs);
  }

  StepResult Step(std::span<const double> a, std::span<double> obs) override {
    ++steps_;
    if (last_action_) last_action_->assign(a.begin(), a.end());
    Observe(obs);
    const bool end = steps_ == length_;
    return {a[0], end && terminated_, end && truncated_};
  }

  void Serialize(StateVisitor& v, const std::string& prefix) override {
    v.Int(prefix + "episode", episode_);
    v.Int(prefix + "steps", steps_);
    v.Double(prefix + "noise", noise_);
  }

 private:
  void Observe(std::span<double> obs) const {
    obs[0] = 100 * episode_ + steps_;
    obs[1] = noise_;
  }

  EnvSpec spec_;
  const int length_;
  const bool terminated_, truncated_;
  std::vector<double>* last_action_;
  int episode_ = 0, steps_ = 0;
  double noise_ = 0;
};

/// Worker 0 terminates after 2 steps, worker 1 is truncated after 3, worker 2 both after 3.
VecEnv ThreeWorkers(std::uint64_t seed = 1) {
  return VecEnv(
      [i = 0]() mutable -> std::unique_ptr<Env> {
        const int worker = i++;
        return std::make_unique<ScriptedEnv>(worker == 0 ? 2 : 3, worker != 1, worker != 0,
                                             nullptr);
      },
      3, seed);
}

VecEnv OneWorker(int length, std::vector<double>* last_action = nullptr) {
  return VecEnv(
      [=]() -> std::unique_ptr<Env> {
        return std::make_unique<ScriptedEnv>(length, true, false, last_action);
      },
      1, 1);
}

/// The action of worker i is i + 1 tenths.
Mat Actions() {
  Mat a = Mat::Zero(2, 3);
  a.row(0) << Real(0.125), Real(0.25), Real(0.5);
  return a;
}

TEST(VecEnv, ClipsActionsToTheControlRange) {
  std::vector<double> seen;
  VecEnv env = OneWorker(10, &seen);
  env.Reset();
  Transition t;
  std::vector<Episode> episodes;
  Mat a(2, 1);
  a << 5, -7;
  env.Step(a, t, episodes);
  EXPECT_EQ(seen, (std::vector<double>{1, -0.5}));
  a << Real(-0.25), Real(0.125);
  env.Step(a, t, episodes);
  EXPECT_EQ(seen, (std::vector<double>{-0.25, 0.125}));
}

TEST(VecEnv, FlagsTheFirstStatesOfEpisodes) {
  VecEnv env = ThreeWorkers();
  Transition t;
  std::vector<Episode> episodes;
  env.Reset();
  EXPECT_EQ(env.EpisodeStarts(), (std::vector<char>{1, 1, 1}));
  env.Step(Actions(), t, episodes);
  EXPECT_EQ(env.EpisodeStarts(), (std::vector<char>{0, 0, 0}));
  env.Step(Actions(), t, episodes);
  EXPECT_EQ(env.EpisodeStarts(), (std::vector<char>{1, 0, 0}));
  env.Step(Actions(), t, episodes);
  EXPECT_EQ(env.EpisodeStarts(), (std::vector<char>{0, 1, 1}));
}

TEST(VecEnv, ReportsTerminationAndTruncationApart) {
  VecEnv env = ThreeWorkers();
  Transition t;
  std::vector<Episode> episodes;
  env.Reset();
  for (int i = 0; i < 2; ++i) env.Step(Actions(), t, episodes);
  EXPECT_TRUE(t.terminated[0]);
  EXPECT_FALSE(t.truncated[0]);
  EXPECT_TRUE(t.Done(0));
  EXPECT_FALSE(t.TimeLimit(0));
  EXPECT_FALSE(t.Done(1));
  env.Step(Actions(), t, episodes);
  EXPECT_FALSE(t.Done(0));
  EXPECT_TRUE(t.TimeLimit(1));
  EXPECT_TRUE(t.Done(2));
  EXPECT_FALSE(t.TimeLimit(2)) << "both flags: terminated wins";
}

TEST(VecEnv, ShowsTheResetObservationAtTheEndOfAnEpisode) {
  VecEnv env = OneWorker(2);
  Transition t;
  std::vector<Episode> episodes;
  env.Reset();
  for (int i = 0; i < 2; ++i) env.Step(Mat::Zero(2, 1), t, episodes);
  // Shown were 100, 101 and, in place of 102, 200: the second episode's first.
  EXPECT_NEAR(env.normalizer().mean()(0), (100 + 101 + 200) / 3.0, 0.01);
  Vec s(2);
  env.normalizer().Apply((VecD(2) << 200, 0).finished(), s);
  EXPECT_EQ(env.States()(0, 0), s(0));
}

TEST(VecEnv, KeepsTheLastObservationWhereTheTimeLimitStruck) {
  VecEnv env = ThreeWorkers();
  Transition t;
  std::vector<Episode> episodes;
  env.Reset();
  for (int i = 0; i < 3; ++i) env.Step(Actions(), t, episodes);
  Vec s(2);
  env.normalizer().Apply((VecD(2) << 103, 0).finished(), s);
  EXPECT_EQ(t.s_last(0, 1), s(0));
  EXPECT_EQ(t.s_last.col(0), Vec::Zero(2)) << "an episode that terminated has none";
  EXPECT_EQ(t.s_last.col(2), Vec::Zero(2));
}

TEST(VecEnv, TakesEveryShownObservationIntoTheNormaliserOnce) {
  VecEnv env = ThreeWorkers();
  Transition t;
  std::vector<Episode> episodes;
  env.Reset();
  EXPECT_DOUBLE_EQ(env.normalizer().count(), 1e-4 + 3);
  for (int i = 0; i < 4; ++i) env.Step(Actions(), t, episodes);  // over three episode ends
  EXPECT_DOUBLE_EQ(env.normalizer().count(), 1e-4 + 3 * 5);
}

TEST(VecEnv, CountsEveryEpisodeFromItsOwnStartHoweverTheOneBeforeEnded) {
  VecEnv env = ThreeWorkers();
  Transition t;
  std::vector<Episode> episodes;
  env.Reset();
  for (int i = 0; i < 6; ++i) env.Step(Actions(), t, episodes);
  std::vector<std::vector<int>> lengths(3);
  for (const Episode& e : episodes) lengths[std::size_t(e.worker)].push_back(e.length);
  EXPECT_EQ(lengths, (std::vector<std::vector<int>>{{2, 2, 2}, {3, 3}, {3, 3}}));
}

TEST(VecEnv, WritesARowAnEpisode) {
  VecEnv env = ThreeWorkers();
  Transition t;
  std::vector<Episode> episodes;
  env.Reset();
  for (int i = 0; i < 4; ++i) env.Step(Actions(), t, episodes);
  ASSERT_EQ(episodes.size(), 4u);
  // Worker 0 ends in the 2nd step: 3 steps of all workers before it, plus worker 0.
  EXPECT_EQ(episodes[0].step, 3);
  EXPECT_EQ(episodes[0].worker, 0);
  EXPECT_EQ(episodes[0].length, 2);
  EXPECT_DOUBLE_EQ(episodes[0].ret, 2 * 0.125);
  EXPECT_TRUE(episodes[0].terminated);
  EXPECT_FALSE(episodes[0].truncated);
  // Workers 1 and 2 in the 3rd.
  EXPECT_EQ(episodes[1].step, 6 + 1);
  EXPECT_EQ(episodes[1].length, 3);
  EXPECT_DOUBLE_EQ(episodes[1].ret, 3 * 0.25);
  EXPECT_FALSE(episodes[1].terminated);
  EXPECT_TRUE(episodes[1].truncated);
  EXPECT_EQ(episodes[2].step, 6 + 2);
  EXPECT_TRUE(episodes[2].terminated && episodes[2].truncated);
  // Worker 0 again in the 4th: return and length began anew.
  EXPECT_EQ(episodes[3].step, 9);
  EXPECT_EQ(episodes[3].length, 2);
  EXPECT_DOUBLE_EQ(episodes[3].ret, 2 * 0.125);
  EXPECT_EQ(env.TotalSteps(), 12);
}

TEST(VecEnv, WorkersResetFromStreamsOfTheirOwn) {
  VecEnv env = ThreeWorkers(5), same = ThreeWorkers(5), other = ThreeWorkers(6);
  for (VecEnv* e : {&env, &same, &other}) e->Reset();
  EXPECT_NE(env.States()(1, 0), env.States()(1, 1));
  EXPECT_EQ(env.States(), same.States());
  EXPECT_NE(env.States(), other.States());
}

TEST(VecEnv, GoesOnFromAStateThatWasKept) {
  VecEnv env = ThreeWorkers(7), other = ThreeWorkers(8);
  Transition t, u;
  std::vector<Episode> episodes, others;
  env.Reset();
  for (int i = 0; i < 4; ++i) env.Step(Actions(), t, episodes);
  MemoryVisitor kept;
  env.Serialize(kept);
  kept.load = true;
  other.Serialize(kept);
  EXPECT_EQ(other.States(), env.States());
  EXPECT_EQ(other.EpisodeStarts(), env.EpisodeStarts());
  episodes.clear();
  for (int i = 0; i < 7; ++i) {
    env.Step(Actions(), t, episodes);
    other.Step(Actions(), u, others);
    ASSERT_EQ(other.States(), env.States()) << "step " << i;
    ASSERT_EQ(u.r, t.r);
    ASSERT_EQ(others.size(), episodes.size());
  }
  EXPECT_EQ(others.back().step, episodes.back().step);
  EXPECT_EQ(others.back().ret, episodes.back().ret);
}

/// Three workers after one step, put on a task whose episodes take 9 steps.
VecEnv AfterAChangeOfTask(bool set_init, int steps) {
  VecEnv env = ThreeWorkers();
  Transition t;
  std::vector<Episode> episodes;
  env.Reset();
  for (int i = 0; i < steps; ++i) env.Step(Actions(), t, episodes);
  env.ChangeTask([] { return std::make_unique<ScriptedEnv>(9, true, false, nullptr); }, set_init);
  return env;
}

TEST(VecEnv, AChangeOfTaskStartsEpisodesAndKeepsTheRest) {
  VecEnv env = AfterAChangeOfTask(true, 1);
  EXPECT_EQ(env.Spec().time_limit, 9);
  EXPECT_EQ(env.TotalSteps(), 3);
  EXPECT_EQ(env.EpisodeStarts(), (std::vector<char>{1, 1, 1}));
  // Three observations of each worker: reset, step, reset on the new task.
  EXPECT_NEAR(env.normalizer().count(), 9 + 1e-4, 1e-12);
  // The first step of the old task belongs to no episode.
  Transition t;
  std::vector<Episode> episodes;
  for (int i = 0; i < 9; ++i) env.Step(Actions(), t, episodes);
  ASSERT_EQ(episodes.size(), 3u);
  EXPECT_EQ(episodes[1].length, 9);
  EXPECT_DOUBLE_EQ(episodes[1].ret, 9 * 0.25);
  EXPECT_EQ(episodes[1].step, 3 + 8 * 3 + 1);
}

TEST(VecEnv, AChangeOfTaskCanLookLikeAContinuation) {
  EXPECT_EQ(AfterAChangeOfTask(false, 1).EpisodeStarts(), (std::vector<char>{0, 0, 0}));
  // Worker 0's episode has just ended after two steps.
  EXPECT_EQ(AfterAChangeOfTask(false, 2).EpisodeStarts(), (std::vector<char>{1, 0, 0}));
}

TEST(VecEnv, RefusesATaskOfOtherSizes) {
  struct Wider final : public Env {
    const EnvSpec& Spec() const override { return spec; }
    void Reset(Rng&, std::span<double>) override {}
    StepResult Step(std::span<const double>, std::span<double>) override { return {}; }
    void Serialize(StateVisitor&, const std::string&) override {}
    EnvSpec spec{"Wider-v0", 3, 2, 9, {-1, -1}, {1, 1}};
  };
  VecEnv env = ThreeWorkers();
  EXPECT_THROW(env.ChangeTask([] { return std::make_unique<Wider>(); }, true), Error);
}

TEST(VecEnv, RefusesActionsOfAnotherShape) {
  VecEnv env = OneWorker(3);
  Transition t;
  std::vector<Episode> episodes;
  env.Reset();
  EXPECT_THROW(env.Step(Mat::Zero(2, 2), t, episodes), Error);
  EXPECT_THROW(env.Step(Mat::Zero(3, 1), t, episodes), Error);
}

TEST(VecEnv, RefusesToHaveNoWorkers) {
  EXPECT_THROW(VecEnv([]() -> std::unique_ptr<Env> { return nullptr; }, 0, 1), Error);
}

}  // namespace
}  // namespace o2v
