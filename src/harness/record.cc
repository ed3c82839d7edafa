#include "harness/record.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/check.h"
#include "base/decimal.h"
#include "base/files.h"

namespace o2v {
namespace {

using nlohmann::ordered_json;

constexpr std::string_view kFirstColumns = "step,return_20";
constexpr std::int64_t kGrid = 10'000;  // [environment steps] ours: 100 rows a million steps

/// Columns of an option in an updates.csv.
struct OptionColumns {
  std::size_t usage, duration;
};

std::vector<OptionColumns> FindOptions(const CsvTable& updates) {
  std::vector<OptionColumns> options;
  for (std::size_t c = 0; c < updates.columns.size(); ++c) {
    if (!updates.columns[c].starts_with("usage_")) continue;
    const std::string k = std::to_string(options.size());
    options.push_back({updates.Column("usage_" + k), updates.Column("duration_" + k + "_steps")});
  }
  return options;
}

/// What the rows [from, to) of an updates.csv say of an option.
struct OptionCount {
  double all = 0, steps = 0, executions = 0;  // steps with any option, with this one
};

/// A row holds its n steps with the option as their share, and n by the b executions that began
/// as duration, or n itself where b is 0. Rounding gives back the whole numbers, except that b = 0
/// looks like b = 1 and counts as one: what a row says alone it says among others, too.
OptionCount CountOption(const CsvTable& updates, const OptionColumns& option, std::size_t from,
                        std::size_t to) {
  OptionCount count;
  for (std::size_t row = from; row < to; ++row) {
    const double all = updates.At(row, 0) - (row > 0 ? updates.At(row - 1, 0) : 0);
    const double steps = std::round(updates.At(row, option.usage) * all);
    const double duration = updates.At(row, option.duration);
    count.all += all;
    count.steps += steps;
    if (duration > 0) count.executions += std::round(steps / duration);
  }
  return count;
}

}  // namespace

std::filesystem::path RecordPath(std::filesystem::path dir, const char* ending) {
  return FolderPath(dir) += ending;
}

std::string RecordCsv(std::span<const CurvePoint> episodes, const CsvTable& updates,
                      std::int64_t steps) {
  const std::vector<CurvePoint> curve = SmoothedReturns(episodes);
  const std::vector<OptionColumns> options = FindOptions(updates);
  std::string text(kFirstColumns);
  for (const OptionColumns& option : options) text += "," + updates.columns[option.usage];
  for (const OptionColumns& option : options) text += "," + updates.columns[option.duration];
  text += "\n";
  std::size_t known = 0;  // points of the curve at or before the grid step
  std::size_t first = 0;  // update since the grid step before
  for (std::int64_t step = 0; step < steps;) {
    step = std::min(step + kGrid, steps);
    while (known < curve.size() && curve[known].first <= step) ++known;
    std::size_t end = first;
    while (end < updates.Rows() && updates.At(end, 0) <= static_cast<double>(step)) ++end;
    if (known > 0) {
      text += Decimal(step) + "," + Decimal(curve[known - 1].second);
      const std::size_t last = std::min(std::max(end, first + 1), updates.Rows());
      const std::size_t from = std::min(first, last - 1);
      std::string durations;
      for (const OptionColumns& option : options) {
        const OptionCount count = CountOption(updates, option, from, last);
        text += "," + Decimal(count.steps / count.all);
        durations += ",";
        if (count.executions > 0) durations += Decimal(count.steps / count.executions);
      }
      text += durations + "\n";
    }
    first = end;
  }
  return text;
}

std::string RecordJson(const std::string& manifest_json, const std::string& config) {
  const ordered_json manifest = ordered_json::parse(manifest_json);
  ordered_json out;
  for (const char* key : {"status", "steps", "revision", "wall_seconds", "cpu_seconds", "commit",
                          "compiler", "flags", "versions"}) {
    if (manifest.contains(key)) out[key] = manifest[key];
  }
  out["config"] = config;
  return out.dump(2) + "\n";
}

void WriteRecord(const std::filesystem::path& dir, const std::string& manifest_json,
                 std::int64_t wanted_steps) {
  const auto steps = ordered_json::parse(manifest_json).at("steps").get<std::int64_t>();
  WriteFileAtomically(RecordPath(dir, ".csv"),
                      RecordCsv(ReadEpisodes(dir / "episodes.csv"),
                                ReadUpdates(dir / "updates.csv"), std::min(wanted_steps, steps)));
  WriteFileAtomically(RecordPath(dir, ".json"),
                      RecordJson(manifest_json, ReadFile(dir / "config.toml")));
}

Record ReadRecord(const std::filesystem::path& path) {
  try {
    const ordered_json in = ordered_json::parse(ReadFile(path));
    return {ParseStatus(in.at("status").get<std::string>()), in.at("steps").get<std::int64_t>(),
            in.value("revision", 1), in.at("cpu_seconds").get<double>(),
            in.at("config").get<std::string>()};
  } catch (const std::exception& e) {
    throw Error(Concat(path.string(), ": cannot be read: ", e.what()));
  }
}

std::optional<Record> FindRecord(const std::filesystem::path& dir, const std::string& config) {
  const std::filesystem::path json = RecordPath(dir, ".json");
  std::error_code error;  // a name that is too long is nobody's
  if (!std::filesystem::exists(json, error)) return std::nullopt;
  if (const auto csv = RecordPath(dir, ".csv"); !std::filesystem::exists(csv)) {
    throw ConfigError(Concat(csv.string(), ": missing; a record is a pair of files, this and ",
                             json.filename().string(), ": write both with `option2vec record ",
                             dir.string(), "`, or move the other away to run it again"));
  }
  const Record record = ReadRecord(json);
  if (record.config != config) {
    throw ConfigError(Concat(json.string(), ": this run was finished with another ",
                             "configuration; move it away to run it again"));
  }
  return record;
}

void RequireRecordPlace(const std::filesystem::path& dir, const std::string& config, bool begun) {
  constexpr std::size_t kLongestName = 255;  // [bytes] of most file systems
  const std::filesystem::path json = RecordPath(dir, ".json"), csv = RecordPath(dir, ".csv");
  const std::size_t longest = json.filename().string().size() + sizeof ".tmp" - 1;
  if (longest > kLongestName) {
    throw ConfigError(Concat(dir.string(), ": its record's name would have ", longest,
                             " bytes, more than ", kLongestName));
  }
  const auto own = [&](const std::filesystem::path& path) {
    try {
      return path == csv ? ReadFile(path).starts_with(kFirstColumns)
                         : ReadRecord(path).config == config;
    } catch (const Error&) {
      return false;
    }
  };
  std::error_code error;
  for (const std::filesystem::path& path : {json, csv}) {
    if (!std::filesystem::exists(std::filesystem::symlink_status(path, error))) continue;
    if (!begun || !std::filesystem::is_regular_file(path) || !own(path)) {
      throw ConfigError(path.string() +
                        ": is in the place of this run's record; move it away first");
    }
  }
}

}  // namespace o2v
