#include "report/replay.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "base/check.h"
#include "base/files.h"
#include "env/mujoco_env.h"

namespace o2v {
namespace {

/// Where the parts of a row begin and how long they are; those that a table lacks are empty.
struct Layout {
  std::size_t nu, nq, nv, returned, target;

  Layout(MujocoEnv& env, const CsvTable& table)
      : nu(env.Spec().a_low.size()), nq(env.qpos().size()), nv(env.qvel().size()) {
    const auto has = [&](const char* name) { return std::ranges::count(table.columns, name) > 0; };
    returned = has("reward") ? 2 + std::size_t(env.Spec().S) : 0;  // reward, terminated, obs
    target = has("target0") ? env.Target().size() : 0;
  }

  std::span<double> ctrl(std::span<double> row) const { return row.subspan(1, nu); }
  std::span<double> qpos(std::span<double> row) const { return row.subspan(1 + nu, nq); }
  std::span<double> qvel(std::span<double> row) const { return row.subspan(1 + nu + nq, nv); }
  std::span<double> results(std::span<double> row) const {
    return row.subspan(1 + nu + nq + nv, returned);
  }
  std::span<double> goal(std::span<double> row) const { return row.last(target); }
};

void CheckColumns(const MujocoEnv& env, const Layout& at, const CsvTable& table) {
  std::vector<std::string> expected = {"step"};
  const auto add = [&](const char* name, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) expected.push_back(name + std::to_string(i));
  };
  add("ctrl", at.nu);
  add("qpos", at.nq);
  add("qvel", at.nv);
  if (at.returned) {
    expected.insert(expected.end(), {"reward", "terminated"});
    add("obs", at.returned - 2);
  }
  add("target", at.target);
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
  const Layout at(sim, trajectory);
  CheckColumns(sim, at, trajectory);
  CheckSteps(trajectory);
  const std::size_t width = trajectory.columns.size(), n = trajectory.Rows();
  std::vector<double> obs(static_cast<std::size_t>(sim.Spec().S));
  CsvTable ours = trajectory;
  for (std::size_t i = 0; i < n; ++i) {
    const std::span<double> row(&ours.values[i * width], width);
    if (row[0] == 0) {
      std::ranges::copy(at.goal(row), sim.Target().begin());
      sim.ResetTo(at.qpos(row), at.qvel(row), obs);
    }
    std::ranges::copy(sim.qpos(), at.qpos(row).begin());
    std::ranges::copy(sim.qvel(), at.qvel(row).begin());
    std::ranges::copy(sim.Target().first(at.target), at.goal(row).begin());
    const bool last = i + 1 == n || trajectory.At(i + 1, 0) == 0;
    const std::span<double> results = at.results(row);
    if (last && std::ranges::all_of(results, [](double x) { return x == 0; })) continue;
    const StepResult step = sim.Step(at.ctrl(row), obs);
    if (results.empty()) continue;
    results[0] = step.reward;
    results[1] = step.terminated;
    std::ranges::copy(obs, results.begin() + 2);
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
