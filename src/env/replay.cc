#include "env/replay.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "base/check.h"
#include "base/files.h"
#include "env/mujoco_env.h"

namespace o2v {
namespace {

// Numbers of an episode's target in a row of the table: those of the task, or none.
std::size_t TargetColumns(MujocoEnv& env, const CsvTable& table) {
  const bool none = std::ranges::count(table.columns, "target0") == 0;
  return none ? 0 : env.Target().size();
}

void CheckColumns(MujocoEnv& env, const CsvTable& table) {
  std::vector<std::string> expected = {"step"};
  const auto add = [&](const char* name, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) expected.push_back(name + std::to_string(i));
  };
  add("ctrl", env.Spec().a_low.size());
  add("qpos", env.qpos().size());
  add("qvel", env.qvel().size());
  add("target", TargetColumns(env, table));
  for (std::size_t i = 0; i < std::min(expected.size(), table.columns.size()); ++i) {
    if (table.columns[i] != expected[i]) {
      throw ConfigError(Concat(table.path, ":1: column ", i + 1, ": expected '", expected[i],
                               "' for ", env.Spec().id, ", got '", table.columns[i], "'"));
    }
  }
  if (table.columns.size() != expected.size()) {
    const bool fewer = table.columns.size() < expected.size();
    throw ConfigError(Concat(table.path, ":1: expected ", expected.size(), " columns for ",
                             env.Spec().id, " ('",
                             fewer ? expected[table.columns.size()] + "' is the first missing one"
                                   : expected.back() + "' is the last",
                             "), got ", table.columns.size()));
  }
}

void CheckSteps(const CsvTable& table) {
  const std::size_t step = table.Column("step");
  for (std::size_t row = 0; row < table.Rows(); ++row) {
    const double next = row == 0 ? 0 : table.At(row - 1, step) + 1;
    const double got = table.At(row, step);
    if (got != 0 && got != next) {
      throw ConfigError(Concat(table.Place(row, step), "expected 0",
                               row ? Concat(" or ", next) : "", ", got ", got));
    }
  }
}

}  // namespace

CsvTable Replay(Env& env, const CsvTable& trajectory) {
  auto& sim = dynamic_cast<MujocoEnv&>(env);
  CheckColumns(sim, trajectory);
  CheckSteps(trajectory);
  const std::size_t nu = sim.Spec().a_low.size(), nq = sim.qpos().size(), nv = sim.qvel().size();
  const std::span<double> target = sim.Target().first(TargetColumns(sim, trajectory));
  std::vector<double> obs(static_cast<std::size_t>(sim.Spec().S));
  CsvTable ours = trajectory;
  for (std::size_t row = 0; row < trajectory.Rows(); ++row) {
    const std::size_t width = trajectory.columns.size();
    const std::span<double> out(&ours.values[row * width], width);
    const std::span<double> qpos = out.subspan(1 + nu, nq), qvel = out.subspan(1 + nu + nq, nv);
    if (out[0] == 0) {
      std::ranges::copy(out.last(target.size()), target.begin());
      sim.ResetTo(qpos, qvel, obs);
    } else {
      sim.Step({&ours.values[(row - 1) * width + 1], nu}, obs);
    }
    std::ranges::copy(sim.qpos(), qpos.begin());
    std::ranges::copy(sim.qvel(), qvel.begin());
    std::ranges::copy(target, out.last(target.size()).begin());
  }
  return ours;
}

Deviation LargestDeviation(const CsvTable& ours, const CsvTable& reference, std::size_t rows) {
  Check(ours.columns == reference.columns && ours.Rows() == reference.Rows(), reference.path,
        ": tables of different shape");
  const std::size_t step = reference.Column("step");
  Deviation worst;
  std::size_t first = 0;
  for (std::size_t row = 0; row < reference.Rows(); ++row) {
    if (reference.At(row, step) == 0) first = row;
    if (row - first >= rows) continue;
    for (std::size_t column = 0; column < reference.columns.size(); ++column) {
      const double b = reference.At(row, column);
      double d = std::abs(ours.At(row, column) - b) / std::max(1.0, std::abs(b));
      if (!std::isfinite(d)) d = std::numeric_limits<double>::infinity();
      if (d > worst.value) worst = {d, row, reference.columns[column]};
    }
  }
  return worst;
}

Deviation ReplayFile(const std::string& task, const std::filesystem::path& trajectory,
                     const std::filesystem::path& out) {
  const std::unique_ptr<Env> env = MakeEnv(task, EnvOptions{});
  const CsvTable reference = ReadCsv(trajectory);
  const CsvTable ours = Replay(*env, reference);
  if (!out.empty()) WriteFileAtomically(out, CsvText(ours));
  return LargestDeviation(ours, reference);
}

}  // namespace o2v
