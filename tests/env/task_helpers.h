#pragma once
// Small things that several tests of tasks need.

#include <algorithm>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/check.h"
#include "base/rng.h"
#include "env/mujoco_env.h"

namespace o2v {

/// A task with what a test does to it. Its own streams: resets draw from one, actions from another.
class TaskUnderTest {
 public:
  explicit TaskUnderTest(const std::string& id, bool contact_forces = false, int time_limit = 0)
      : env(Make(id, contact_forces, time_limit)), obs(std::size_t(env->Spec().S)) {}

  void Reset() { env->Reset(resets, obs); }
  void ResetTo(const std::vector<double>& qpos, const std::vector<double>& qvel) {
    env->ResetTo(qpos, qvel, obs);
  }
  StepResult Step(const std::vector<double>& a) { return env->Step(a, obs); }
  /// A random action inside the control range.
  std::vector<double> Action() {
    std::vector<double> a;
    for (std::size_t i = 0; i < env->Spec().a_low.size(); ++i) {
      a.push_back(actions.Uniform(env->Spec().a_low[i], env->Spec().a_high[i]));
    }
    return a;
  }
  StepResult StepAtRandom() { return Step(Action()); }
  std::vector<double> NoAction() const { return std::vector<double>(env->Spec().a_low.size()); }

  std::vector<double> Qpos() const { return {env->qpos().begin(), env->qpos().end()}; }
  std::vector<double> Qvel() const { return {env->qvel().begin(), env->qvel().end()}; }
  std::vector<double> Qpos0() const {
    const mjModel& m = env->model();
    return {m.qpos0, m.qpos0 + m.nq};
  }
  std::vector<double> AtRest() const { return std::vector<double>(std::size_t(env->model().nv)); }
  /// World coordinate i of a body's frame, as the simulator has it now.
  double Xpos(const char* body, int i) const {
    return env->data().xpos[3 * mj_name2id(&env->model(), mjOBJ_BODY, body) + i];
  }

  std::unique_ptr<MujocoEnv> env;
  Rng resets{1, "resets"}, actions{1, "actions"};  // seed 1
  std::vector<double> obs;

 private:
  static std::unique_ptr<MujocoEnv> Make(const std::string& id, bool contact_forces, int limit) {
    for (const EnvEntry& entry : EnvRegistry()) {
      if (entry.id != id) continue;
      auto made = entry.make({.contact_forces = contact_forces}, limit ? limit : entry.time_limit);
      return std::unique_ptr<MujocoEnv>(dynamic_cast<MujocoEnv*>(made.release()));
    }
    throw Error("no task " + id);
  }
};

/// Takes gravity, contacts and limits away: what rests stays where it is put.
inline void LetFloat(TaskUnderTest& task) {
  task.env->model().opt.disableflags |= mjDSBL_GRAVITY | mjDSBL_CONSTRAINT;
}

/// All that a caller sees of a step, as bytes.
inline std::string Bytes(const TaskUnderTest& task, const StepResult& result) {
  std::string bytes;
  const auto add = [&](std::span<const double> x) {
    bytes.append(reinterpret_cast<const char*>(x.data()), x.size_bytes());
  };
  add(task.obs);
  add(task.env->qpos());
  add(task.env->qvel());
  add({&task.env->data().time, 1});
  add({&result.reward, 1});
  bytes += result.terminated ? 'T' : '-';
  bytes += result.truncated ? 'L' : '-';
  return bytes;
}

inline std::vector<std::string> AllTasks() {
  std::vector<std::string> ids;
  for (const EnvEntry& entry : EnvRegistry()) ids.push_back(entry.id);
  return ids;
}

/// "Hopper-v2" -> "Hopperv2", as a test's name.
inline std::string TestName(std::string id) {
  std::erase_if(id, [](char c) { return c == '-' || c == '_'; });
  return id;
}

/// Keeps what a Serialize shows.
class SavingVisitor final : public StateVisitor {
 public:
  void Matrix(std::string_view name, Mat&) override { throw Error("matrix " + std::string(name)); }
  void Doubles(std::string_view name, double* x, std::size_t n) override {
    Check(doubles.emplace(name, std::vector<double>(x, x + n)).second, name, " twice");
  }
  void Ints(std::string_view name, std::int64_t* x, std::size_t n) override {
    Check(ints.emplace(name, std::vector<std::int64_t>(x, x + n)).second, name, " twice");
  }

  std::map<std::string, std::vector<double>> doubles;
  std::map<std::string, std::vector<std::int64_t>> ints;
};

/// Gives it back.
class LoadingVisitor final : public StateVisitor {
 public:
  explicit LoadingVisitor(const SavingVisitor& saved) : saved_(saved) {}
  void Matrix(std::string_view name, Mat&) override { throw Error("matrix " + std::string(name)); }
  void Doubles(std::string_view name, double* x, std::size_t n) override {
    Copy(saved_.doubles.at(std::string(name)), x, n);
  }
  void Ints(std::string_view name, std::int64_t* x, std::size_t n) override {
    Copy(saved_.ints.at(std::string(name)), x, n);
  }

 private:
  template <typename T>
  static void Copy(const std::vector<T>& from, T* to, std::size_t n) {
    Check(from.size() == n, "got ", from.size(), " numbers, not ", n);
    std::copy(from.begin(), from.end(), to);
  }
  const SavingVisitor& saved_;
};

}  // namespace o2v
