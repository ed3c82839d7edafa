#pragma once
// The paper's theory as a list of numbers that are small, or are not: run by gtest and by the
// program theory.

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "exact/tabular.h"

namespace o2v::exact {

/// What is claimed, what is measured, and what the measure has to be.
struct Statement {
  enum class Relation : char { kBelow = '<', kAbove = '>' };

  std::string name;      // as in the paper; a reading that does not hold ends in ": false"
  std::string compared;  // one sentence
  Relation relation;
  double bound;
  std::function<double(const Instance&)> gap;

  /// NaN never holds.
  bool Holds(double measured) const {
    return relation == Relation::kBelow ? measured < bound : measured > bound;
  }
};

/// Seeds of the instances are 0, ..., kInstances - 1: as many as there are rows (s, o'), so that
/// the sampled statements start from each row once.
constexpr int kInstances = kRows;

/// The gap of the instance that comes nearest to breaking the statement, or breaks it most; NaN if
/// one has no number.
struct Worst {
  double gap;
  int seed;
};
Worst WorstOf(const Statement& statement);

/// All of them, in the order of spec 9. Names and sentences have no commas (they go into a CSV).
std::vector<Statement> AllStatements();

}  // namespace o2v::exact
