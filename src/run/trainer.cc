#include "run/trainer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <iomanip>
#include <ostream>
#include <sstream>
#include <system_error>

#include "base/check.h"
#include "base/files.h"
#include "env/pairs.h"
#include "run/checkpoint.h"
#include "run/evaluate.h"
#include "run/metrics.h"
#include "run/progress_line.h"
#include "run/record.h"
#include "run/run_folder.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;  // for timing and progress only, never for training

double Seconds(Clock::duration d) { return std::chrono::duration<double>(d).count(); }
double CpuSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// UTC, ISO 8601.
std::string Now() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  std::ostringstream out;
  out << std::put_time(&utc, "%Y-%m-%dT%H:%M:%SZ");
  return out.str();
}

/// True when a multiple of `every` lies in (before, now]; never for every = 0.
bool Crossed(std::int64_t every, std::int64_t before, std::int64_t now) {
  return every > 0 && now / every > before / every;
}

/// What a run that has ended says when it is asked to go on: nothing is left to do.
RunStatus Ended(const fs::path& dir, RunStatus status, std::ostream& progress) {
  if (status == RunStatus::kDiverged) throw DivergedError(dir.string() + ": this run has diverged");
  progress << dir.string() << ": this run is already done" << std::endl;
  return status;
}

/// True when no entry is infinite or NaN: these times zero are NaN. Unlike Eigen's allFinite, in
/// whole registers.
template <typename Derived>
bool AllFinite(const Eigen::DenseBase<Derived>& x) {
  return (x.derived().array() * 0).sum() == 0;
}

/// timing.csv: appended to by every process that worked on the run.
class TimingLog {
 public:
  explicit TimingLog(const fs::path& path) : path_(path) {
    const std::string text = fs::exists(path) ? ReadFile(path) : "";
    const std::size_t rows =
        text.rfind('\n') + 1;  // what a full disk tore off is cut; npos + 1 = 0
    if (rows < text.size()) fs::resize_file(path, rows);
    if (rows == 0) AppendToFile(path, "step,wall_s,cpu_s,steps_per_s\n");
  }
  void Row(std::int64_t step, double wall, double cpu, double rate) {
    AppendToFile(path_, Concat(step, ",", wall, ",", cpu, ",", rate, "\n"));
  }

 private:
  fs::path path_;
};

/// Thrown when a signal stops an evaluation. No checkpoint can stand between an
/// update and its evaluation, so the run goes on from the one before.
struct StoppedInEvaluation {};

Metadata Describe(const RunConfig& config, const EnvSpec& spec, Algorithm& algorithm,
                  std::int64_t total_steps) {
  std::string switches;
  for (const SwitchInfo& info : SwitchRegistry()) {
    if (!Concerns(info, config)) continue;
    switches +=
        (switches.empty() ? "" : " ") + info.name + "=" + SwitchValue(config.switches, info);
  }
  return {{"task", config.task},
          {"method", config.algorithm},
          {"fidelity", ToString(config.fidelity)},
          {"switches", switches},
          {"sizes", Concat("S=", spec.S, " A=", spec.A, " K=", algorithm.NumOptions())},
          {"total_steps", std::to_string(total_steps)},
          {"config", ToToml(config)}};
}

/// A run in its folder, from the first step or from its last checkpoint.
class Run {
 public:
  Run(const RunConfig& config, const RunParts& parts, const fs::path& dir, const RunHooks& hooks,
      std::ostream& progress, bool terminal)
      : config_(config),
        parts_(parts),
        hooks_(hooks),
        dir_(dir),
        env_(MakeTask(0), config.workers, config.seed),
        algorithm_(parts.make_algorithm(env_.Spec())),
        params_(algorithm_->Params()),
        logs_(dir, algorithm_->StatNames(), config.eval_every > 0),
        progress_(progress, terminal, config.steps) {}

  /// Loads the last checkpoint where there is one. `before` is the manifest of the processes
  /// before.
  void Start(const std::optional<Manifest>& before) {
    if (before && before->revision != parts_.revision) {
      throw ConfigError(Concat(dir_.string(), ": this run was started by revision ",
                               before->revision, " of the method; this program has revision ",
                               parts_.revision));
    }
    manifest_.start = before ? before->start : Now();
    manifest_.revision = parts_.revision;
    wall_before_ = before ? before->wall_seconds : 0;
    cpu_before_ = before ? before->cpu_seconds : 0;
    const fs::path path = Checkpoint();
    if (fs::exists(path)) {
      if (parts_.tasks > 1) {
        // LoadCheckpoint wants the simulators of the task that the file was written on.
        const auto steps = TotalSteps(ReadMetadata(path));
        Check(steps.has_value(), path.string(), ": no total_steps in its metadata");
        task_ = TaskAt(*steps);
        env_.ReplaceEnvs(MakeTask(task_));
      }
      const Metadata metadata = LoadCheckpoint(path, *algorithm_, Walk());
      Check(metadata == Describe(config_, env_.Spec(), *algorithm_, env_.TotalSteps()),
            path.string(),
            ": not the checkpoint of this run: its metadata disagree with config.toml");
      logs_.Resume();
    } else {
      logs_.Create();
      env_.Reset();
    }
    SaveManifest(RunStatus::kRunning);
  }

  RunStatus Loop() {
    TimingLog timing(dir_ / "timing.csv");
    while (env_.TotalSteps() < config_.steps) {
      const std::int64_t before = env_.TotalSteps();
      const Clock::time_point begin = Clock::now();
      Iterate();
      const std::int64_t now = env_.TotalSteps();
      const bool done = now >= config_.steps;
      if (TaskAt(now) != task_) ChangeTask();
      const bool stop = !done && hooks_.stop && hooks_.stop();
      const double rate = static_cast<double>(now - before) / Seconds(Clock::now() - begin);
      timing.Row(now, Wall(), Cpu(), rate);
      progress_.Show(now, rate, Seconds(Clock::now() - begin_), done || stop);
      if (done || stop || Crossed(config_.checkpoint_every, before, now)) Save();
      if (stop) return RunStatus::kStopped;
    }
    return RunStatus::kDone;
  }

  /// Writes what a run of this status leaves behind, the record last.
  void Finish(RunStatus status) {
    LogEpisodes();       // of a rollout or an update that diverged
    logs_.EndUpdates();  // a resumed run cuts it off again
    logs_.Flush();
    manifest_.end = Now();
    SaveManifest(status);
    if (status != RunStatus::kStopped) WriteRecord(dir_, ManifestJson(manifest_), config_.steps);
  }

 private:
  fs::path Checkpoint() const { return dir_ / "last.ckpt"; }
  double Wall() const { return wall_before_ + Seconds(Clock::now() - begin_); }
  double Cpu() const { return cpu_before_ + CpuSeconds(); }

  StateWalk Walk() {
    return [this](StateVisitor& v) {
      algorithm_->Serialize(v);
      env_.Serialize(v);
      logs_.Serialize(v);
    };
  }

  VecEnv::Factory MakeTask(int task) const {
    return [this, task] { return parts_.make_env(task); };
  }

  /// The task after the update that ends at `step`: the next one from beyond its segment's end.
  int TaskAt(std::int64_t step) const {
    int task = 0;
    while (task + 1 < parts_.tasks && step * parts_.tasks > config_.steps * (task + 1)) ++task;
    return task;
  }

  /// Keeps the policy that the task before has left.
  void ChangeTask() {
    Normalizer normalizer = env_.normalizer();
    SavePolicy(dir_ / (env_.Spec().id + ".safetensors"),
               Describe(config_, env_.Spec(), *algorithm_, env_.TotalSteps()), *algorithm_,
               normalizer);
    task_ = TaskAt(env_.TotalSteps());
    env_.ChangeTask(MakeTask(task_), config_.switches.switch_init_flag == Fidelity::kPaper);
    algorithm_->ChangeTask();
  }

  void Iterate() {
    const std::int64_t before = env_.TotalSteps();
    algorithm_->Collect(env_, episodes_);
    const std::vector<SumAndCount>& stats = algorithm_->Update();
    RequireFinite(stats);
    LogEpisodes();
    logs_.AddUpdate(env_.TotalSteps(), stats);
    if (Crossed(config_.eval_every, before, env_.TotalSteps())) LogEvaluation();
  }

  /// Throws DivergedError when the update left a number that is not finite, before that is logged
  /// or saved: a statistic, a parameter, the normaliser.
  void RequireFinite(const std::vector<SumAndCount>& stats) const {
    for (std::size_t i = 0; i < stats.size(); ++i) {
      if (!std::isfinite(stats[i].sum)) Diverged(algorithm_->StatNames()[i]);
    }
    for (const Param* p : params_) {
      if (!AllFinite(p->value)) Diverged(p->name);
    }
    if (!AllFinite(env_.normalizer().mean())) Diverged("normalizer.mean");
    if (!AllFinite(env_.normalizer().var())) Diverged("normalizer.var");
  }
  [[noreturn]] void Diverged(const std::string& what) const {
    throw DivergedError(Concat(env_.Spec().id, ": ", what,
                               " is not finite after the update at step ", env_.TotalSteps()));
  }

  void LogEpisodes() {
    for (const Episode& episode : episodes_) {
      logs_.AddEpisode(episode);
      progress_.AddEpisode(episode.ret);
    }
    episodes_.clear();
  }

  void LogEvaluation() {
    const std::unique_ptr<Env> env = parts_.make_env(task_);
    const auto episodes = Evaluate(*algorithm_, env_.normalizer(), *env, config_.eval_episodes,
                                   /*sample_action=*/true, config_.seed, {}, hooks_.stop);
    if (int(episodes.size()) < config_.eval_episodes) throw StoppedInEvaluation();
    int number = 0;
    for (const EvalEpisode& e : episodes) logs_.AddEval(env_.TotalSteps(), number++, e.ret);
  }

  /// The logs first: the checkpoint holds their lengths, and they are cut to these on resume.
  void Save() {
    logs_.Flush();
    if (hooks_.before_checkpoint) hooks_.before_checkpoint();
    SaveCheckpoint(Checkpoint(), Describe(config_, env_.Spec(), *algorithm_, env_.TotalSteps()),
                   *algorithm_, Walk(), hooks_.before_rename);
    SaveManifest(RunStatus::kRunning);
  }

  void SaveManifest(RunStatus status) {
    manifest_.status = status;
    manifest_.steps = env_.TotalSteps();
    manifest_.wall_seconds = Wall();
    manifest_.cpu_seconds = Cpu();
    WriteManifest(dir_, manifest_);
  }

  const RunConfig& config_;
  const RunParts& parts_;
  const RunHooks& hooks_;
  const fs::path dir_;
  int task_ = 0;  // that the workers are on
  VecEnv env_;
  std::unique_ptr<Algorithm> algorithm_;
  const std::vector<Param*> params_;
  RunLogs logs_;
  ProgressLine progress_;
  Manifest manifest_;
  std::vector<Episode> episodes_;  // of the running iteration
  const Clock::time_point begin_ = Clock::now();
  double wall_before_ = 0, cpu_before_ = 0;
};

}  // namespace

RunParts PartsOf(const RunConfig& config) {
  const EnvOptions options{.contact_forces = config.switches.contact_forces};
  const std::vector<std::string> tasks = SplitTasks(config.task);
  const EnvSpec first = MakeEnv(tasks[0], options)->Spec();
  for (const std::string& task : tasks) {
    const EnvSpec spec = MakeEnv(task, options)->Spec();
    if (spec.S != first.S || spec.A != first.A) {
      throw ConfigError(Concat("tasks '", config.task, "': ", first.id, " has ", first.S,
                               " observations and ", first.A, " actions, ", spec.id, " has ",
                               spec.S, " and ", spec.A));
    }
  }
  return {[=](int task) { return MakeEnv(tasks[std::size_t(task)], options); },
          [&config](const EnvSpec& spec) { return MakeRunAlgorithm(config, spec); },
          static_cast<int>(tasks.size()), FindAlgorithm(config.algorithm).revision};
}

RunStatus Train(const RunConfig& config, const RunParts& parts, const fs::path& dir, bool resume,
                std::ostream& progress, bool terminal, const RunHooks& hooks) {
  const fs::path folder = FolderPath(dir);
  const std::string text = ToToml(config);
  Run run(config, parts, folder, hooks, progress,
          terminal);  // a bad config leaves no folder behind
  std::error_code error;
  const bool begun = fs::exists(folder / "config.toml", error);
  if (!begun && resume) {  // its record is enough, as for `jobs`
    if (const auto record = FindRecord(folder, text))
      return Ended(folder, record->status, progress);
  }
  if (!begun) RequireRecordPlace(folder, text, begun);
  const bool made = fs::create_directories(folder, error);
  if (error) throw ConfigError(Concat(folder.string(), ": cannot be created: ", error.message()));
  const FolderLock lock(folder);
  const std::optional<Manifest> before = ReadManifest(folder);
  try {
    if (PrepareFolder(folder, text, resume, before)) {
      const bool half = !fs::exists(RecordPath(folder, ".csv"));  // killed before it was whole
      if (half || !fs::exists(RecordPath(folder, ".json"))) {
        WriteRecord(folder, ReadFile(folder / "manifest.json"), config.steps);
      }
      return Ended(folder, before->status, progress);
    }
  } catch (const ConfigError&) {
    if (made) fs::remove(folder, error);  // empty
    throw;
  }
  try {
    run.Start(before);
    const RunStatus status = run.Loop();
    run.Finish(status);
    return status;
  } catch (const StoppedInEvaluation&) {
    run.Finish(RunStatus::kStopped);
    return RunStatus::kStopped;
  } catch (const DivergedError&) {
    run.Finish(RunStatus::kDiverged);
    throw;
  }
}

RunStatus Train(const RunConfig& config, const fs::path& dir, bool resume, std::ostream& progress,
                bool terminal, const RunHooks& hooks) {
  return Train(config, PartsOf(config), dir, resume, progress, terminal, hooks);
}

}  // namespace o2v
