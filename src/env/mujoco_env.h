#pragma once
// A task simulated by MuJoCo: all that the tasks have in common. Included by tasks, their registry,
// replay, src/render and tests only: nothing else sees MuJoCo.

#include <mujoco/mujoco.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "env/env.h"

namespace o2v {

/// Takes an observation entry after entry.
class ObservationWriter {
 public:
  explicit ObservationWriter(std::span<double> out) : out_(out) {}

  void Add(double x) { Next(1)[0] = x; }
  void Add(std::span<const double> x);
  /// Each entry clipped to [-bound, bound].
  void AddClipped(std::span<const double> x, double bound);
  /// Entries that are still missing.
  std::size_t Missing() const { return out_.size(); }

 private:
  std::span<double> Next(std::size_t n);  // the next n entries; throws Error when there are fewer

  std::span<double> out_;
};

/// Sum of squares.
double SquaredNorm(std::span<const double> x);
/// Adds U(-bound, bound) to each entry, in order.
void AddUniform(Rng& rng, double bound, std::span<double> x);
/// Adds scale * N(0, 1) to each entry, in order.
void AddNormal(Rng& rng, double scale, std::span<double> x);

/// One simulated task. A derived class states the task's rules; stepping, time limit, divergence
/// and resumption are here. Neither Reset nor Step allocates. Source: spec E.1.
class MujocoEnv : public Env {
 public:
  const EnvSpec& Spec() const final { return spec_; }
  void Reset(Rng& rng, std::span<double> obs) final;
  StepResult Step(std::span<const double> a, std::span<double> obs) final;
  void Serialize(StateVisitor& v, const std::string& prefix) override;

  /// Starts an episode at a given qpos (nq), qvel (nv) instead of a random one.
  void ResetTo(std::span<const double> qpos, std::span<const double> qvel, std::span<double> obs);

  std::span<const double> qpos() const { return {data_->qpos, std::size_t(model_->nq)}; }
  std::span<const double> qvel() const { return {data_->qvel, std::size_t(model_->nv)}; }
  /// The numbers of an episode that are in the model, not in qpos (where a target is): none, in
  /// most tasks. Part of the saved state; Reset draws them, ResetTo takes them as they are.
  virtual std::span<double> Target() { return {}; }
  /// Seconds of an environment step.
  double dt() const { return model_->opt.timestep * frame_skip_; }
  /// File name of the model without its ending, "gym_hopper".
  const std::string& ModelName() const { return model_name_; }
  /// The simulator itself, for the tasks, replay, parity and tests.
  const mjModel& model() const { return *model_; }
  mjModel& model() { return *model_; }
  const mjData& data() const { return *data_; }
  mjData& data() { return *data_; }

 protected:
  struct Facts {
    std::string id;     // "Hopper-v2"
    std::string model;  // "gym_hopper": models/gym_hopper.xml
    int frame_skip;     // physics steps of an environment step
    int S;              // observation size
  };
  struct Outcome {
    double reward;
    bool terminated = false;
  };

  MujocoEnv(const Facts& facts, const EnvOptions& options, int time_limit);

  /// Adds the reset noise. Given qpos0 and zeros; draws for qpos entry after entry, then for qvel,
  /// then for Target. It may let the simulator run: the episode starts after it.
  virtual void DrawStart(Rng& rng, std::span<double> qpos, std::span<double> qvel) = 0;
  /// An environment step with the controls in data().ctrl: `frame_skip` calls of mj_step with no
  /// mj_forward after, so that quantities derived from the position (xpos, xipos, site_xpos,
  /// cinert, ...) are those of the last substep's start (RK4: of its last stage), as in gym.
  virtual void Simulate();
  /// Derives the rest of an episode's first state from qpos and qvel: mj_forward.
  virtual void ComputeDerived();
  /// The one number of a state that the reward of the next step reads (a position, a distance). It
  /// is taken after a reset and after each step, when it is as stale as in the reference.
  virtual double RewardQuantity() const { return 0; }
  /// Reward and end of the step that has just been simulated with a (A); before, after: the reward
  /// quantity at both ends of it.
  virtual Outcome RewardAndEnd(double before, double after, std::span<const double> a) const = 0;
  virtual void Observe(ObservationWriter& obs) const = 0;

  int frame_skip() const { return frame_skip_; }
  /// Throw Error when the model has no such body, geom, site or sensor.
  int BodyId(const char* name) const { return Id(mjOBJ_BODY, name); }
  int GeomId(const char* name) const { return Id(mjOBJ_GEOM, name); }
  int SiteId(const char* name) const { return Id(mjOBJ_SITE, name); }
  int SensorId(const char* name) const { return Id(mjOBJ_SENSOR, name); }

  /// External torques and forces on all bodies, the world first (6, nbody); zeros unless
  /// EnvOptions::contact_forces. MuJoCo >= 2.0 fills them on demand only.
  std::span<const double> cfrc_ext() const {
    return {data_->cfrc_ext, 6 * std::size_t(model_->nbody)};
  }

 private:
  struct Delete {
    void operator()(mjModel* m) const { mj_deleteModel(m); }
    void operator()(mjData* d) const { mj_deleteData(d); }
  };
  static std::unique_ptr<mjModel, Delete> Load(const std::string& name);

  int Id(mjtObj type, const char* name) const;
  void Clear();                       // all that an episode leaves behind but qpos and qvel
  void Begin(std::span<double> obs);  // an episode at the current qpos, qvel
  void Finish(
      std::span<double> obs);  // of a reset or step: contact forces, reward quantity, observation
  void CheckWarnings() const;
  [[noreturn]] void Diverged(const std::string& what) const;

  EnvSpec spec_;
  std::string model_name_;
  int frame_skip_;
  bool contact_forces_;
  std::unique_ptr<mjModel, Delete> model_;
  std::unique_ptr<mjData, Delete> data_;
  double reward_quantity_ = 0;  // of the current state
  std::int64_t steps_ = 0;      // of the running episode
};

}  // namespace o2v
