#pragma once
// The table of an experiment's results beside the authors' numbers.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "report/stats.h"

namespace o2v {

/// Mean and population standard deviation over n of the authors' runs.
struct Published {
  double mean = 0, std = 0;
  int n = 0;
};

/// What the authors' runs returned at `step`: their return_at_1M from one million steps on, before
/// that their mean curve (linear between grid points). For a pair (by its name) return_task1_end at
/// one million and return_task2_end from two million steps on, the curve elsewhere. Nothing where
/// they have no runs, or for a method that is not theirs. Source: results/reference/README.md.
std::optional<Published> PublishedReturn(const std::string& task, const std::string& algorithm,
                                         std::int64_t step);

/// One line of the table: the runs of one task or pair, method and fidelity over seeds, at the end
/// of a task.
struct SummaryRow {
  std::string fidelity, task, algorithm;
  std::int64_t step = 0;       // [environment steps] that the returns belong to
  std::vector<double> values;  // smoothed return of every run that came to `step` and has one
  int n_diverged = 0;          // runs that broke off before it
  int n_short = 0;             // runs that came to it with fewer than 20 episodes, hence no value
  int n_older = 0;             // runs by older revisions of the method's code, left out
};

/// What an experiment's records say.
struct ExperimentSummary {
  std::vector<SummaryRow> rows;      // by fidelity, task and method
  std::vector<std::string> refused;  // of each record that does not count: its file and why
};

/// Reads the records below `experiment` (results/quick), through links, without hidden files. A
/// record counts when it lies where it belongs (RequirePlace), and, as the runs of a row have one
/// configuration, when its own is the row's most frequent one. `step` of a row is the end of a
/// task, at most 1 000 000 a task. Of each row only the runs of the newest revision among them
/// count.
ExperimentSummary Summarize(const std::filesystem::path& experiment);

/// fidelity, task, algorithm, step, n_seeds, mean, std, stderr, iqm, ci_low, ci_high as CSV: std
/// with divisor n, 95 % bootstrap interval of the mean. A row without values is left out.
std::string SummaryCsv(const std::vector<SummaryRow>& rows);

/// The same for the eye, with the authors' numbers and with the runs that are left out.
std::string SummaryTable(const std::vector<SummaryRow>& rows);

}  // namespace o2v
