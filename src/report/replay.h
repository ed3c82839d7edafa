#pragma once
// Open-loop trajectories: a file's states against those that our simulation reaches.

#include <filesystem>
#include <limits>
#include <string>

#include "base/csv.h"
#include "env/env.h"

namespace o2v {

/// A largest deviation |a - b| / max(1, |b|) and where it stands.
struct Deviation {
  double value = 0;
  std::size_t row = 0;  // 0-based, of the table
  std::string column;   // empty when nothing deviates
};

/// Rolls a task along a trajectory. Columns: step, ctrl0.., qpos0.., qvel0..; a row holds the
/// controls applied at that step and the state before it. Further columns, each of them optional:
///   reward, terminated, obs0..   what the task returns after the step (a step oracle); where all
///                                of them are 0, the last row, or the last before one with step 0,
///                                is only a state
///   target0..                    a target in the model (dm-reacher), of which only rows with step
///                                0 are read
/// A row with step 0 is injected (reset, state, target, forward call); the others are reached by
/// stepping with the controls of the row before.
/// Returns ours in the same rows and columns. Throws ConfigError, naming file, line and column,
/// when the columns are not the task's or the steps do not count up; DivergedError as Env::Step.
/// Source: spec E.6.
CsvTable Replay(Env& env, const CsvTable& trajectory);

/// Largest deviation of `ours` from a reference of the same shape, over the first `rows` rows of
/// each segment (rows from one with step 0 up to the next). A non-finite deviation counts as
/// infinite.
Deviation LargestDeviation(const CsvTable& ours, const CsvTable& reference,
                           std::size_t rows = std::numeric_limits<std::size_t>::max());

/// Replays a file with a task and compares all its rows. Writes our table to `out` unless it is
/// empty.
Deviation ReplayFile(const std::string& task, const std::filesystem::path& trajectory,
                     const std::filesystem::path& out);

}  // namespace o2v
