#pragma once
// Statistics of the updates: a row of updates.csv.

#include <string>
#include <utility>
#include <vector>

#include "algo/algorithm.h"

namespace o2v {

/// Columns of updates.csv: a name and the term that it shows.
using LossColumns = std::vector<std::pair<std::string, double LossTerms::*>>;

/// Mean of the terms of a stage's minibatches.
class LossMeans {
 public:
  /// more: columns beside those of all methods.
  explicit LossMeans(const LossColumns& more = {});
  void Clear();
  void Add(const LossTerms& terms, double grad_norm);
  /// Appends total, surrogate, value, entropy, kl, clip_fraction, the other columns and grad_norm,
  /// in the order of Names.
  void Report(std::vector<SumAndCount>& values) const;
  /// The columns of `stage`.
  static void Names(const std::string& stage, std::vector<std::string>& names,
                    const LossColumns& more = {});

 private:
  LossColumns columns_;
  std::vector<double> sums_;
  double grad_norm_ = 0;
  int n_ = 0;
};

/// How often and how long the options were executed since Clear.
class OptionUsage {
 public:
  explicit OptionUsage(Index K) : executed_(std::size_t(K), 0), begun_(executed_) {}

  void Clear();
  /// A step with option o, after o_prev or at an episode's start.
  void Count(int o, int o_prev, bool init);
  /// Appends each option's share of the steps, then the mean length [steps] of its executions: its
  /// steps by the executions that began. Cut anywhere and added up again they are the same: an
  /// execution counts once, where it began, and its steps where they are.
  void Report(std::vector<SumAndCount>& values) const;
  /// The columns of Report.
  void Names(std::vector<std::string>& names) const;

 private:
  std::vector<double> executed_, begun_;  // (K) steps of each option; its executions
};

}  // namespace o2v
