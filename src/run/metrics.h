#pragma once
// The CSV files of a run folder.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "algo/algorithm.h"
#include "base/csv.h"
#include "base/state.h"
#include "rollout/vec_env.h"

namespace o2v {

/// An append-only CSV file that a checkpoint can refer to by its length and hash.
class CsvLog {
 public:
  CsvLog(std::filesystem::path path, std::string header);

  /// Starts an empty file: the header only.
  void Create();
  /// Cuts the file to the state last seen by Serialize and appends from there. Throws Error when
  /// the file is shorter, its beginning has changed, or its columns are other ones.
  void Resume();
  /// Appends a row of ready cells.
  void Row(const std::vector<std::string>& cells);
  /// Brings all rows to the disk. Throws Error with the system's reason when it cannot.
  void Flush();

  /// `<prefix>.bytes`, `<prefix>.hash`.
  void Serialize(StateVisitor& v, const std::string& prefix);

 private:
  void Append(const std::string& line);

  std::filesystem::path path_;
  std::string header_;
  std::string pending_;     // rows that are not in the file yet
  std::int64_t bytes_ = 0;  // of all rows so far
  std::int64_t hash_ = 0;   // Fnv1a of them
};

/// episodes.csv, updates.csv and, where wanted, evals.csv.
class RunLogs {
 public:
  /// Of updates.csv: an update of as many environment steps has a row of its own; smaller ones are
  /// put together. Ours: PPO's rollout.
  static constexpr std::int64_t kRowSteps = 2048;

  /// updates.csv has the column `step` and `stat_names`.
  RunLogs(const std::filesystem::path& dir, const std::vector<std::string>& stat_names, bool evals);

  void Create();
  void Resume();
  void AddEpisode(const Episode& episode);
  /// The statistics of the update at `step`. A row is written, with the values of the sums of the
  /// updates since the last row, once kRowSteps have passed since that.
  void AddUpdate(std::int64_t step, std::span<const SumAndCount> statistics);
  /// No update follows: writes a row of those since the last one.
  void EndUpdates();
  void AddEval(std::int64_t step, int episode, double ret);
  /// Before a checkpoint, which holds the lengths of the files: none may be shorter than it says.
  void Flush();
  void Serialize(StateVisitor& v);

 private:
  CsvLog episodes_, updates_;
  std::int64_t row_step_ = 0, step_ = 0;  // of the last row, of the last update
  VecD sums_, ns_;                        // of the updates after row_step_
  std::vector<CsvLog> evals_;             // one or none
};

/// A point of a learning curve: step [environment steps], return.
using CurvePoint = std::pair<std::int64_t, double>;

/// The authors' smoothing: the mean return of the last 20 episodes, at the step of the 20th.
/// Empty for fewer than 20 episodes.
std::vector<CurvePoint> SmoothedReturns(std::span<const CurvePoint> episodes);

/// (step, return) of every row of an episodes.csv.
std::vector<CurvePoint> ReadEpisodes(const std::filesystem::path& path);
/// An updates.csv; a table without columns when no update was made.
CsvTable ReadUpdates(const std::filesystem::path& path);

}  // namespace o2v
