#include "harness/record.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/check.h"
#include "base/decimal.h"
#include "base/files.h"

namespace o2v {
namespace {

using nlohmann::ordered_json;

constexpr std::int64_t kGrid = 10'000;  // [environment steps] ours: 100 rows a million steps

}  // namespace

std::filesystem::path RecordPath(std::filesystem::path dir, const char* ending) {
  return dir += ending;
}

std::string RecordCsv(std::span<const CurvePoint> episodes, const CsvTable& updates,
                      std::int64_t steps) {
  const std::vector<CurvePoint> curve = SmoothedReturns(episodes);
  std::vector<std::size_t> options;  // columns
  std::string text = "step,return_20";
  for (std::size_t c = 0; c < updates.columns.size(); ++c) {
    const std::string& name = updates.columns[c];
    if (!name.starts_with("usage_") && !name.starts_with("duration_")) continue;
    options.push_back(c);
    text += "," + name;
  }
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
      for (const std::size_t c : options) {
        double sum = 0;
        for (std::size_t row = from; row < last; ++row) sum += updates.At(row, c);
        text += "," + Decimal(sum / static_cast<double>(last - from));
      }
      text += "\n";
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

}  // namespace o2v
