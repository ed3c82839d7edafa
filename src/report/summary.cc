#include "report/summary.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <map>
#include <sstream>
#include <string_view>
#include <tuple>

#include "algo/algorithm.h"
#include "base/check.h"
#include "base/files.h"
#include "embedded/reference.h"
#include "env/pairs.h"
#include "report/align.h"
#include "run/record.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMillion = 1'000'000;    // [environment steps] return_at_1M's
constexpr std::uint64_t kBootstrapSeed = 2021;  // any number: makes the intervals repeatable

/// Rows of an embedded reference file, without its header.
std::vector<std::vector<std::string>> ReferenceRows(std::string_view name) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& file : Embedded_reference()) {
    if (file.name != name) continue;
    std::istringstream in{std::string(file.text)};
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) {
      std::istringstream cells(line);
      for (rows.emplace_back(); std::getline(cells, line, ',');) rows.back().push_back(line);
    }
  }
  Check(!rows.empty(), "no reference ", name);
  return rows;
}

using Key = std::tuple<std::string, std::string, std::string>;  // fidelity, task, algorithm

/// The records `depth` folders below `dir`: .json files.
void FindRecords(const fs::path& dir, int depth, std::vector<fs::path>& found) {
  std::vector<fs::path> inside;
  for (const auto& entry : fs::directory_iterator(dir)) inside.push_back(entry.path());
  std::sort(inside.begin(), inside.end());
  for (const fs::path& path : inside) {
    if (path.filename().string().starts_with('.')) continue;
    std::error_code error;  // of a link in a circle: no folder
    if (depth > 0 && fs::is_directory(path, error)) FindRecords(path, depth - 1, found);
    if (depth == 0 && path.extension() == ".json") found.push_back(path);
  }
}

/// The runs that have the most frequent configuration, of several the first one's. The others are
/// refused.
std::vector<Record> OfOneConfiguration(const std::map<fs::path, Record>& records,
                                       std::vector<std::string>& refused) {
  const auto like = [&](const Record& x) {
    return std::ranges::count_if(records, [&](const auto& record) {
      return Difference(record.second.config, x.config).empty();
    });
  };
  const Record* most = nullptr;
  for (const auto& [file, record] : records) {
    if (!most || like(record) > like(*most)) most = &record;
  }
  std::vector<Record> runs;
  for (const auto& [file, record] : records) {
    const std::string difference = Difference(record.config, most->config);
    if (difference.empty()) {
      runs.push_back(record);
    } else {
      refused.push_back(Concat(file.string(), ": differs from the other runs: ", difference));
    }
  }
  return runs;
}

/// The row at the end of task `task` (from 1), or of one million steps on it.
SummaryRow MakeRow(const Key& key, const std::vector<Record>& runs, std::int64_t task,
                   std::int64_t tasks) {
  SummaryRow row;
  std::tie(row.fidelity, row.task, row.algorithm) = key;
  row.step = std::min(kMillion * task, runs[0].config.steps * task / tasks);
  for (const Record& run : runs) {
    const auto after = std::find_if(run.curve.begin(), run.curve.end(),
                                    [&](const auto& point) { return point.first > row.step; });
    if (run.status == RunStatus::kDiverged && run.steps < row.step) {
      ++row.n_diverged;
    } else if (after == run.curve.begin()) {
      ++row.n_short;
    } else {
      row.values.push_back(std::prev(after)->second);
    }
  }
  return row;
}

/// Six significant digits, as the authors' tables.
std::string Six(double x) {
  std::ostringstream out;
  out << std::setprecision(6) << x;
  return out.str();
}

/// For the eye: four significant digits, no exponents.
std::string Four(double x) {
  const double size = std::abs(x);
  std::ostringstream out;
  out << std::fixed << std::setprecision(size < 10 ? 3 : size < 100 ? 2 : size < 1000 ? 1 : 0) << x;
  return out.str();
}

}  // namespace

std::optional<Published> PublishedReturn(const std::string& task, const std::string& algorithm,
                                         std::int64_t step) {
  const auto& methods = AlgorithmRegistry();
  const auto method = std::ranges::find(methods, algorithm, &AlgorithmEntry::id);
  if (method == methods.end()) return std::nullopt;
  const bool pair = SplitTasks(task).size() > 1;
  if (step >= kMillion && (!pair || step == kMillion || step >= 2 * kMillion)) {
    // suite,env,algorithm,embed_dim,run,steps_logged,return_at_1M,return_last
    // pair,first_task,second_task,algorithm,embed_dim,run,return_task1_end,return_task2_end,...
    std::vector<double> returns;
    for (const auto& row : ReferenceRows(pair ? "transfer_runs.csv" : "single_task_runs.csv")) {
      if (pair && row.at(0) == task && row.at(3) == method->name) {
        returns.push_back(std::stod(row.at(step == kMillion ? 6 : 7)));
      }
      if (!pair && row.at(0) == "final" && row.at(1) == task && row.at(2) == method->name) {
        returns.push_back(std::stod(row.at(6)));
      }
    }
    if (returns.empty()) return std::nullopt;
    return Published{Mean(returns), Std(returns), static_cast<int>(returns.size())};
  }
  std::vector<std::pair<std::int64_t, Published>> curve;  // env or pair,algorithm,step,mean,std,n
  for (const auto& row : ReferenceRows(pair ? "transfer_curves.csv" : "single_task_curves.csv")) {
    if (row.at(0) != task || row.at(1) != method->name) continue;
    curve.emplace_back(std::stoll(row.at(2)),
                       Published{std::stod(row.at(3)), std::stod(row.at(4)), std::stoi(row.at(5))});
  }
  const auto above = std::find_if(curve.begin(), curve.end(),
                                  [&](const auto& point) { return point.first >= step; });
  if (above == curve.end()) return std::nullopt;
  if (above->first == step) return above->second;
  const auto& [low_step, low] = *std::prev(above);
  const double part =
      static_cast<double>(step - low_step) / static_cast<double>(above->first - low_step);
  return Published{std::lerp(low.mean, above->second.mean, part),
                   std::lerp(low.std, above->second.std, part), low.n};
}

ExperimentSummary Summarize(const fs::path& experiment) {
  ExperimentSummary summary;
  std::vector<fs::path> files;
  constexpr int kDepth = 3;  // fidelity, task, algorithm
  if (fs::is_directory(experiment)) FindRecords(experiment, kDepth, files);
  const fs::path absolute = fs::absolute(experiment / "").lexically_normal();  // "results/quick/"
  const std::string name = absolute.parent_path().filename();
  std::map<Key, std::map<int, std::map<fs::path, Record>>> groups;  // then by revision
  for (const fs::path& file : files) {
    try {
      Record record = ReadRecord(file);
      RequirePlace(file, name, record.config);
      const fs::path below = file.lexically_relative(experiment);
      const std::vector<std::string> parts(below.begin(), below.end());
      groups[{parts[0], parts[1], parts[2]}][record.revision].emplace(file, std::move(record));
    } catch (const Error& e) {
      summary.refused.emplace_back(e.what());
    }
  }
  for (const auto& [key, by_revision] : groups) {
    int all = 0;
    for (const auto& [revision, records] : by_revision) all += static_cast<int>(records.size());
    const auto& newest = by_revision.rbegin()->second;
    const std::vector<Record> runs = OfOneConfiguration(newest, summary.refused);
    const auto tasks = static_cast<std::int64_t>(SplitTasks(runs[0].config.task).size());
    for (std::int64_t task = 1; task <= tasks; ++task) {
      summary.rows.push_back(MakeRow(key, runs, task, tasks));
      summary.rows.back().n_older = all - static_cast<int>(newest.size());
    }
  }
  return summary;
}

std::string SummaryCsv(const std::vector<SummaryRow>& rows) {
  std::string text = "fidelity,task,algorithm,step,n_seeds,mean,std,stderr,iqm,ci_low,ci_high\n";
  for (const SummaryRow& row : rows) {
    if (row.values.empty()) continue;
    const Interval ci = BootstrapInterval(row.values, kBootstrapSeed);
    text += Concat(row.fidelity, ",", row.task, ",", row.algorithm, ",", row.step, ",",
                   row.values.size(), ",", Six(Mean(row.values)), ",", Six(Std(row.values)), ",",
                   Six(StdError(row.values)), ",", Six(Iqm(row.values)), ",", Six(ci.low), ",",
                   Six(ci.high), "\n");
  }
  return text;
}

std::string SummaryTable(const std::vector<SummaryRow>& rows) {
  std::vector<std::vector<std::string>> table = {{"fidelity", "task", "method", "step", "n",
                                                  "mean +- std", "stderr", "IQM", "95 % interval",
                                                  "authors (n)", "left out"}};
  for (const SummaryRow& row : rows) {
    std::vector<std::string> line = {row.fidelity, row.task, row.algorithm,
                                     std::to_string(row.step), std::to_string(row.values.size())};
    if (row.values.empty()) {
      line.insert(line.end(), 4, "-");
    } else {
      const Interval ci = BootstrapInterval(row.values, kBootstrapSeed);
      line.push_back(Concat(Four(Mean(row.values)), " +- ", Four(Std(row.values))));
      line.push_back(Four(StdError(row.values)));
      line.push_back(Four(Iqm(row.values)));
      line.push_back(Concat("[", Four(ci.low), ", ", Four(ci.high), "]"));
    }
    const auto authors = PublishedReturn(row.task, row.algorithm, row.step);
    line.push_back(
        authors ? Concat(Four(authors->mean), " +- ", Four(authors->std), " (", authors->n, ")")
                : "-");
    line.push_back(row.n_diverged + row.n_short + row.n_older == 0
                       ? ""
                       : Concat(row.n_diverged, " diverged, ", row.n_short, " short, ", row.n_older,
                                " older"));
    table.push_back(std::move(line));
  }

  return AlignColumns(table) +
         "\nA return is the mean of the last 20 training episodes at the step; mean +- std "
         "(divisor "
         "n)\n"
         "over n seeds. authors: their curves at that step, or their return_at_1M from 1000000 on. "
         "Compare\n"
         "them with `released`. left out: runs that diverged before the step, that have fewer than "
         "20\n"
         "episodes (short), or that an older revision of the method made (older).\n";
}

}  // namespace o2v
