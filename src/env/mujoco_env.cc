#include "env/mujoco_env.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <type_traits>

#include "base/check.h"
#include "embedded/models.h"

namespace o2v {
namespace {

static_assert(std::is_same_v<mjtNum, double>);

void PrintAndAbort(const char* message) {
  std::fprintf(stderr, "MuJoCo: %s\n", message);
  std::abort();
}

// Counted warnings are read after each step. MuJoCo's own handler would write a log file.
void Ignore(const char*) {}

void SetHandlersOnce() {
  [[maybe_unused]] static const bool done = [] {
    mju_user_error = PrintAndAbort;
    mju_user_warning = Ignore;
    return true;
  }();
}

// Warnings that stop a run: MuJoCo has repaired the state, or dropped a part of it.
struct NamedWarning {
  mjtWarning type;
  const char* name;
};
constexpr NamedWarning kWarnings[] = {
    {mjWARN_INERTIA, "INERTIA"},     {mjWARN_CONTACTFULL, "CONTACTFULL"},
    {mjWARN_CNSTRFULL, "CNSTRFULL"}, {mjWARN_BADQPOS, "BADQPOS"},
    {mjWARN_BADQVEL, "BADQVEL"},     {mjWARN_BADQACC, "BADQACC"},
    {mjWARN_BADCTRL, "BADCTRL"},
};

}  // namespace

std::span<double> ObservationWriter::Next(std::size_t n) {
  Check(n <= out_.size(), "observation: ", n - out_.size(), " entries too many");
  const std::span<double> next = out_.first(n);
  out_ = out_.subspan(n);
  return next;
}

void ObservationWriter::Add(std::span<const double> x) {
  std::copy(x.begin(), x.end(), Next(x.size()).begin());
}

void ObservationWriter::AddClipped(std::span<const double> x, double bound) {
  std::transform(x.begin(), x.end(), Next(x.size()).begin(),
                 [bound](double value) { return std::clamp(value, -bound, bound); });
}

double SquaredNorm(std::span<const double> x) {
  double sum = 0;
  for (double value : x) sum += value * value;
  return sum;
}

void AddUniform(Rng& rng, double bound, std::span<double> x) {
  for (double& value : x) value += rng.Uniform(-bound, bound);
}

void AddNormal(Rng& rng, double scale, std::span<double> x) {
  for (double& value : x) value += scale * rng.Normal();
}

std::unique_ptr<mjModel, MujocoEnv::Delete> MujocoEnv::Load(const std::string& name) {
  SetHandlersOnce();
  // All files, because models include each other. A VFS is 2 MB large.
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  for (const auto& file : Embedded_models()) {
    const std::string path(file.name);
    const int failed =
        mj_makeEmptyFileVFS(files.get(), path.c_str(), static_cast<int>(file.text.size()));
    Check(failed == 0, "model file ", path, ": ", failed == 1 ? "no room" : "there twice");
    const int i = mj_findFileVFS(files.get(), path.c_str());
    Check(i >= 0, "model file ", path, ": not found again");
    std::memcpy(files->filedata[i], file.text.data(), file.text.size());
  }
  char error[1000] = "";
  std::unique_ptr<mjModel, Delete> model(
      mj_loadXML((name + ".xml").c_str(), files.get(), error, sizeof error));
  mj_deleteVFS(files.get());
  Check(model && !error[0], "model ", name, ": ", error);
  return model;
}

MujocoEnv::MujocoEnv(const Facts& facts, const EnvOptions& options, int time_limit)
    : model_name_(facts.model),
      frame_skip_(facts.frame_skip),
      contact_forces_(options.contact_forces),
      model_(Load(facts.model)),
      data_(mj_makeData(model_.get())) {
  Check(time_limit > 0, facts.id, ": time limit ", time_limit, ", not a positive number");
  Check(model_->na == 0 && model_->nmocap == 0, model_name_,
        ": activations or mocap bodies, which a reset does not know");
  spec_ = {facts.id, facts.S, model_->nu, time_limit, {}, {}};
  for (int i = 0; i < model_->nu; ++i) {
    spec_.a_low.push_back(model_->actuator_ctrlrange[2 * i]);
    spec_.a_high.push_back(model_->actuator_ctrlrange[2 * i + 1]);
  }
}

int MujocoEnv::Id(mjtObj type, const char* name) const {
  const int id = mj_name2id(model_.get(), type, name);
  Check(id >= 0, model_name_, ": no ", mju_type2Str(type), " '", name, "'");
  return id;
}

void MujocoEnv::Reset(Rng& rng, std::span<double> obs) {
  const std::span<double> q(data_->qpos, qpos().size()), v(data_->qvel, qvel().size());
  std::copy_n(model_->qpos0, q.size(), q.begin());
  std::fill(v.begin(), v.end(), 0.0);
  Clear();
  DrawStart(rng, q, v);
  Begin(obs);
}

void MujocoEnv::ResetTo(std::span<const double> q, std::span<const double> v,
                        std::span<double> obs) {
  Check(q.size() == qpos().size() && v.size() == qvel().size(), spec_.id, ": got ", q.size(),
        " positions and ", v.size(), " velocities, not ", qpos().size(), " and ", qvel().size());
  std::copy(q.begin(), q.end(), data_->qpos);
  std::copy(v.begin(), v.end(), data_->qvel);
  Clear();
  Begin(obs);
}

// mj_resetData clears some MB, most of it the constraint solver's. Of all that only this reaches
// the next step: mj_forward and mj_step compute the rest from it, and nobody sets applied forces.
void MujocoEnv::Clear() {
  std::fill_n(data_->qacc_warmstart, model_->nv, 0.0);
  std::fill_n(data_->ctrl, model_->nu, 0.0);
  std::fill_n(data_->warning, int{mjNWARNING}, mjWarningStat{});
  steps_ = 0;
}

void MujocoEnv::Begin(std::span<double> obs) {
  data_->time = 0;
  ComputeDerived();
  CheckWarnings();
  Finish(obs);
}

StepResult MujocoEnv::Step(std::span<const double> a, std::span<double> obs) {
  Check(a.size() == spec_.a_low.size(), spec_.id, ": got ", a.size(), " actions, not ", spec_.A);
  std::copy(a.begin(), a.end(), data_->ctrl);
  Simulate();
  ++steps_;
  CheckWarnings();
  const double before = reward_quantity_;
  Finish(obs);
  const Outcome outcome = RewardAndEnd(before, reward_quantity_, a);
  if (!std::isfinite(outcome.reward)) Diverged("non-finite reward");
  return {outcome.reward, outcome.terminated, steps_ >= spec_.time_limit};
}

void MujocoEnv::ComputeDerived() { mj_forward(model_.get(), data_.get()); }

void MujocoEnv::Simulate() {
  for (int i = 0; i < frame_skip_; ++i) mj_step(model_.get(), data_.get());
}

void MujocoEnv::Finish(std::span<double> obs) {
  Check(obs.size() == static_cast<std::size_t>(spec_.S), spec_.id, ": room for ", obs.size(),
        " observations, not ", spec_.S);
  if (contact_forces_) mj_rnePostConstraint(model_.get(), data_.get());
  reward_quantity_ = RewardQuantity();
  ObservationWriter writer(obs);
  Observe(writer);
  Check(writer.Missing() == 0, spec_.id, ": ", writer.Missing(), " observations too few");
  for (std::size_t i = 0; i < obs.size(); ++i) {
    if (!std::isfinite(obs[i])) Diverged(Concat("non-finite observation ", i));
  }
}

void MujocoEnv::CheckWarnings() const {
  for (const NamedWarning& warning : kWarnings) {
    const mjWarningStat& stat = data_->warning[warning.type];
    if (stat.number != 0) {
      Diverged(Concat("simulator warning ", warning.name, " (", stat.lastinfo, ")"));
    }
  }
}

void MujocoEnv::Diverged(const std::string& what) const {
  throw DivergedError(Concat(spec_.id, ": ", what, " at step ", steps_, " of the episode"));
}

// mj_step computes everything that it reads from these and the controls, and the observation and
// the reward quantity are those of the last step: no forward call is needed, and saving changes
// nothing.
void MujocoEnv::Serialize(StateVisitor& v, const std::string& prefix) {
  v.Double(prefix + "time", data_->time);
  v.Doubles(prefix + "qpos", data_->qpos, qpos().size());
  v.Doubles(prefix + "qvel", data_->qvel, qvel().size());
  v.Doubles(prefix + "qacc_warmstart", data_->qacc_warmstart, qvel().size());
  v.Double(prefix + "gauge", reward_quantity_);
  v.Within(0, spec_.time_limit);
  v.Int(prefix + "episode_step", steps_);
  const std::span<double> target = Target();
  if (!target.empty()) v.Doubles(prefix + "target", target.data(), target.size());
}

}  // namespace o2v
