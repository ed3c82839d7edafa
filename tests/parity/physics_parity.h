#pragma once
// Our physics beside the reference's: compiled models, trajectories, step oracles.
// A task joins by its registry line and its files in tests/data.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "base/csv.h"
#include "base/files.h"
#include "env/mujoco_env.h"
#include "parity/model_dump.h"
#include "report/replay.h"

namespace o2v {

/// One line of the parity table.
struct ParityRow {
  std::string check, name;  // "model" gym_ant, "trajectory" gym_ant, "steps" Ant-v2
  double deviation = 0;     // model: see FieldDeviation; else |a - b| / max(1, |b|), first 10 rows
  double bound = 0;
  std::string where;
  double all_rows = 0;  // the same over the whole file, which has no bound: contacts drift

  bool Pass() const { return deviation <= bound; }
};

/// Rows of a segment that have a bound. Source: spec E.6.
constexpr std::size_t kBoundRows = 10;

inline std::unique_ptr<MujocoEnv> MakeMujocoEnv(const std::string& task) {
  return std::unique_ptr<MujocoEnv>(
      dynamic_cast<MujocoEnv*>(MakeEnv(task, EnvOptions{}).release()));
}

inline std::string Where(const Deviation& d) {
  return d.column.empty() ? "" : d.column + " of line " + std::to_string(d.row + 2);
}

/// Bound: 1e-14 + 1e-9 |b|, of which the deviation is a share.
inline ParityRow ModelParity(const MujocoEnv& env, const std::filesystem::path& data) {
  const std::filesystem::path file = data / "models" / (env.ModelName() + ".json");
  const FieldDeviation d =
      CompareDumps(ModelDump::Of(env.model()), ModelDump::Json::parse(ReadFile(file)));
  return {"model", env.ModelName(), d.value, 1, d.field, d.value};
}

inline ParityRow TrajectoryParity(MujocoEnv& env, const std::filesystem::path& data) {
  const CsvTable reference = ReadCsv(data / "trajectories" / (env.ModelName() + ".csv"));
  const CsvTable ours = Replay(env, reference);
  const Deviation d = LargestDeviation(ours, reference, kBoundRows);
  return {"trajectory", env.ModelName(), d.value,
          1e-9,         Where(d),        LargestDeviation(ours, reference).value};
}

/// A wrong `terminated` deviates by 1, and so breaks the bound.
inline ParityRow StepParity(MujocoEnv& env, const std::filesystem::path& data) {
  const CsvTable reference = ReadCsv(data / "env_steps" / (env.Spec().id + ".csv"));
  const CsvTable ours = Replay(env, reference);
  const Deviation d = LargestDeviation(ours, reference, kBoundRows);
  return {"steps", env.Spec().id, d.value, 1e-8, Where(d), LargestDeviation(ours, reference).value};
}

/// All checks of all tasks; a model that several tasks share is checked once.
inline std::vector<ParityRow> PhysicsParity(const std::filesystem::path& data) {
  std::vector<ParityRow> rows;
  std::vector<std::string> models;
  for (const EnvEntry& entry : EnvRegistry()) {
    const auto env = MakeMujocoEnv(entry.id);
    if (std::ranges::count(models, env->ModelName()) == 0) {
      models.push_back(env->ModelName());
      rows.push_back(ModelParity(*env, data));
      rows.push_back(TrajectoryParity(*env, data));
    }
    rows.push_back(StepParity(*env, data));
  }
  return rows;
}

}  // namespace o2v
