#include "run/record.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/check.h"
#include "base/decimal.h"
#include "base/files.h"
#include "env/pairs.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::int64_t kFormat = 1;  // of a record's files
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

/// A whole number of a JSON object.
std::int64_t Whole(const ordered_json& in, const char* key) {
  const ordered_json& x = in.at(key);
  const std::int64_t value = x.is_number_integer() ? x.get<std::int64_t>() : -1;
  Check(value >= 0, "'", key, "' is ", x.dump(), ", not a whole number");
  return value;
}

/// Step and return of each row of a RecordCsv. Cells of options may be empty.
std::vector<CurvePoint> ReadCurve(const fs::path& csv, std::int64_t steps) {
  const CsvTable table = ReadCsv(csv, {.rows = true, .cells = true});
  const std::size_t step = table.Column("step"), ret = table.Column("return_20");
  std::vector<CurvePoint> curve;
  double before = 0;
  for (std::size_t row = 0; row < table.Rows(); ++row) {
    const double at = table.At(row, step), value = table.At(row, ret);
    Check(at == std::floor(at) && at > before && at <= static_cast<double>(steps),
          table.Place(row, step), "expected a whole number above ", before, ", at most ", steps);
    Check(std::isfinite(value), table.Place(row, ret), "expected a number");
    curve.emplace_back(static_cast<std::int64_t>(at), value);
    before = at;
  }
  return curve;
}

/// What the name of a folder says: "paper-o2v_dropout=0.2-hidden=8".
struct Variant {
  std::string fidelity;
  std::vector<std::string> set;  // "o2v_dropout=0.2", "hidden=8"
};

/// A value may hold a hyphen (1e-08), a key does not: a part without '=' belongs to the one before.
Variant ParseVariant(const std::string& folder) {
  Variant variant;
  std::istringstream in(folder);
  std::getline(in, variant.fidelity, '-');
  for (std::string part; std::getline(in, part, '-');) {
    if (part.find('=') == std::string::npos && !variant.set.empty()) {
      variant.set.back() += "-" + part;
    } else {
      variant.set.push_back(part);
    }
  }
  return variant;
}

}  // namespace

std::string SeedFolder(std::uint64_t seed) {
  const std::string digits = std::to_string(seed);
  constexpr std::size_t kDigits = 3;
  return "seed-" + std::string(kDigits - std::min(kDigits, digits.size()), '0') + digits;
}

fs::path RecordPath(fs::path dir, const char* ending) { return FolderPath(dir) += ending; }

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
  ordered_json out = {{"format", kFormat}};
  for (const char* key : {"status", "steps", "revision", "wall_seconds", "cpu_seconds", "commit",
                          "compiler", "flags", "versions"}) {
    if (manifest.contains(key)) out[key] = manifest[key];
  }
  out["config"] = config;
  return out.dump(2) + "\n";
}

void WriteRecord(const fs::path& dir, const std::string& manifest_json, std::int64_t wanted_steps) {
  const auto steps = ordered_json::parse(manifest_json).at("steps").get<std::int64_t>();
  WriteFileAtomically(RecordPath(dir, ".csv"),
                      RecordCsv(ReadEpisodes(dir / "episodes.csv"),
                                ReadUpdates(dir / "updates.csv"), std::min(wanted_steps, steps)));
  WriteFileAtomically(RecordPath(dir, ".json"),
                      RecordJson(manifest_json, ReadFile(dir / "config.toml")));
}

RecordHead ReadRecordHead(const fs::path& json) {
  try {
    const ordered_json in = ordered_json::parse(ReadFile(json));
    const std::int64_t format = in.contains("format") ? Whole(in, "format") : 1;
    Check(format == kFormat, "format ", format, "; this program reads ", kFormat);
    return {ParseStatus(in.at("status").get<std::string>()), Whole(in, "steps"),
            in.contains("revision") ? static_cast<int>(Whole(in, "revision")) : 1,
            in.value("cpu_seconds", 0.0), in.at("config").get<std::string>()};
  } catch (const std::exception& e) {
    throw Error(Concat(json.string(), ": ", e.what()));
  }
}

Record ReadRecord(const fs::path& json, const std::vector<AddedKey>& added) {
  Record record{ReadRecordHead(json), {}, {}};
  try {
    record.config = ParseRunConfig(record.config_text, "config", added);
    const std::int64_t wanted = record.config.steps;
    Check(record.status == RunStatus::kDone || record.status == RunStatus::kDiverged, "status ",
          ToString(record.status));
    Check(record.status == RunStatus::kDiverged || record.steps >= wanted, "done after ",
          record.steps, " of ", wanted, " steps");
    record.curve = ReadCurve(fs::path(json).replace_extension(".csv"), record.steps);
    return record;
  } catch (const std::exception& e) {
    throw Error(Concat(json.string(), ": ", e.what()));
  }
}

void RequirePlace(const fs::path& json, const std::string& experiment, const RunConfig& config) {
  try {
    const fs::path method = json.parent_path(), task = method.parent_path();
    const auto agree = [](const fs::path& place, const std::string& content) {
      Check(place == content, "lies in the place of ", place, ", but belongs to ", content);
    };
    agree(json.filename(), SeedFolder(config.seed) + ".json");
    agree(method.filename(), config.algorithm);
    agree(task.filename(), TasksName(SplitTasks(config.task)));
    const Variant variant = ParseVariant(task.parent_path().filename().string());
    agree(variant.fidelity, ToString(config.fidelity));
    RunRequest request;
    request.config = FindSuite(experiment);
    if (!request.config) request.config = ConfigText{json.string(), ToToml(config)};
    request.task = config.task;
    request.algorithm = config.algorithm;
    request.fidelity = ToString(config.fidelity);
    request.steps = config.steps;
    request.set = variant.set;
    const std::string difference = Difference(config, ResolveRun(request));
    Check(difference.empty(), "lies in the place of another configuration: ", difference);
  } catch (const std::exception& e) {
    throw Error(Concat(json.string(), ": ", e.what()));
  }
}

std::string Difference(const RunConfig& a, const RunConfig& b) {
  RunConfig like_b = a;
  like_b.seed = b.seed;
  like_b.checkpoint_every = b.checkpoint_every;
  like_b.eval_every = b.eval_every;
  like_b.eval_episodes = b.eval_episodes;
  std::istringstream lines_a(ToToml(like_b)), lines_b(ToToml(b));
  for (std::string line_a, line_b;;) {
    const bool more_a = static_cast<bool>(std::getline(lines_a, line_a));
    const bool more_b = static_cast<bool>(std::getline(lines_b, line_b));
    if (!more_a && !more_b) return "";
    if (!more_a || !more_b || line_a != line_b) return Concat(line_a, ", not ", line_b);
  }
}

std::optional<RecordHead> FindRecord(const fs::path& dir, const std::string& config,
                                     const std::vector<AddedKey>& added) {
  const fs::path json = RecordPath(dir, ".json");
  std::error_code error;  // a name that is too long is nobody's
  if (!fs::exists(fs::symlink_status(json, error))) return std::nullopt;
  if (const auto csv = RecordPath(dir, ".csv"); !fs::exists(csv, error)) {
    throw ConfigError(Concat(csv.string(), ": missing. A record is this file and ",
                             json.filename().string(), "; rewrite both with `option2vec record ",
                             dir.string(), "`, or move the other away to repeat the run"));
  }
  const RecordHead head = ReadRecordHead(json);
  if (head.config_text != config &&
      ToToml(ParseRunConfig(head.config_text, json.string(), added)) != config) {
    throw ConfigError(Concat(json.string(), ": the record of another configuration; ",
                             "move it away to repeat the run"));
  }
  return head;
}

void RequireRecordPlace(const fs::path& dir, const std::string& config, bool begun) {
  constexpr std::size_t kLongestName = 255;  // [bytes] of most file systems
  const fs::path json = RecordPath(dir, ".json"), csv = RecordPath(dir, ".csv");
  const std::size_t longest = json.filename().string().size() + kTemporaryEnding;
  if (longest > kLongestName) {
    throw ConfigError(Concat(dir.string(), ": the name of its record would have ", longest,
                             " bytes, more than ", kLongestName));
  }
  const auto own = [&](const fs::path& path) {
    try {
      return path == csv ? ReadFile(path).starts_with(kFirstColumns)
                         : ReadRecordHead(path).config_text == config;
    } catch (const Error&) {
      return false;
    }
  };
  std::error_code error;
  for (const fs::path& path : {json, csv}) {
    if (!fs::exists(fs::symlink_status(path, error))) continue;
    if (!begun || !fs::is_regular_file(path) || !own(path)) {
      throw ConfigError(path.string() +
                        ": the record of this run goes here; move this file away first");
    }
  }
}

}  // namespace o2v
