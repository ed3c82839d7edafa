#pragma once
// What is kept of a finished run: two small files beside its folder, seed-003.csv and
// seed-003.json.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/csv.h"
#include "run/config.h"
#include "run/manifest.h"
#include "run/metrics.h"

namespace o2v {

/// The last folder of a run's path: seed-003.
std::string SeedFolder(std::uint64_t seed);

/// A file of the record of the run in the folder `dir`, see FolderPath; `ending` is ".csv" or
/// ".json".
std::filesystem::path RecordPath(std::filesystem::path dir, const char* ending);

/// The record of a finished run, as CSV on a grid of 10 000 steps up to `steps` (and `steps`
/// itself). `return_20`: the last smoothed return at or before the grid step, not interpolated; no
/// row before the first. The row of step 1 000 000 is therefore exactly return_at_1M. `usage_k` and
/// `duration_k_steps`, for methods with options: of the updates since the grid step before put
/// together, steps with the option by steps and by executions; of the next update when there was
/// none. The duration of an option that was not used is an empty cell.
std::string RecordCsv(std::span<const CurvePoint> episodes, const CsvTable& updates,
                      std::int64_t steps);

/// What made a record, as JSON: {"format" (1; absent in records of before it was written),
/// "status", "steps", "revision" (of the method's code),
/// "wall_seconds", "cpu_seconds", "commit", "compiler", "flags", "versions"} of the manifest.json
/// given, and "config" (resolved, TOML).
std::string RecordJson(const std::string& manifest_json, const std::string& config);

/// Writes the record of the run in `dir`, done or diverged, whose manifest.json has this text and
/// whose config asks for `wanted_steps`. The other files of the folder are read. Throws Error when
/// one of them is damaged.
void WriteRecord(const std::filesystem::path& dir, const std::string& manifest_json,
                 std::int64_t wanted_steps);

/// The .json of a record, read.
struct RecordHead {
  RunStatus status;         // done or diverged
  std::int64_t steps;       // environment steps of all workers
  int revision;             // of the method's code; 1 where the file does not say
  double cpu_seconds;       // over all processes that worked on the run; 0: the file does not say
  std::string config_text;  // resolved, TOML
};
/// Reads a file of RecordJson, of this or an older format. Throws Error, which names the file.
RecordHead ReadRecordHead(const std::filesystem::path& json);

/// A whole record, read.
struct Record : RecordHead {
  RunConfig config;
  std::vector<CurvePoint> curve;  // smoothed returns, by step; empty: fewer than 20 episodes
};
/// Reads both files of a record, `json` and the .csv beside it, of this or an older format. Throws
/// Error, which names the file, for a damaged one and for one that contradicts itself.
Record ReadRecord(const std::filesystem::path& json,
                  const std::vector<AddedKey>& added = AddedKeys());

/// Throws Error, which names the file, unless a record lies where it belongs:
/// <experiment>/<fidelity>[-<key>=<value>]/<task or pair>/<method>/seed-003.json says what its
/// configuration says. In an experiment that is compiled into the program (FindSuite) the
/// configuration is the experiment's with the keys of the folder, and nothing else, for any number
/// of steps; `experiment` is its name.
void RequirePlace(const std::filesystem::path& json, const std::string& experiment,
                  const RunConfig& config);

/// Where two configurations of a task and method differ, except in what runs of a cell may differ
/// in: seed, checkpoints, evaluations. "hidden = 8, not hidden = 64"; empty: nowhere.
std::string Difference(const RunConfig& a, const RunConfig& b);

/// The record of the run of this configuration in `dir`; nothing when there is none. Throws
/// ConfigError for half a record and for that of another configuration.
std::optional<RecordHead> FindRecord(const std::filesystem::path& dir, const std::string& config,
                                     const std::vector<AddedKey>& added = AddedKeys());

/// Throws ConfigError unless the record of this run can be written beside `dir`: the names fit, and
/// no file there is somebody's own. `begun`: the run may have been killed while it wrote its
/// record.
void RequireRecordPlace(const std::filesystem::path& dir, const std::string& config, bool begun);

}  // namespace o2v
