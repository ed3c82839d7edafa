#pragma once
// How many parameters the methods have, by task, architecture and width.

#include <optional>
#include <string>
#include <vector>

#include "run/config.h"

namespace o2v {

/// One network of the table.
struct ParamRow {
  std::string task;
  int S = 0, A = 0;
  std::string method;
  Fidelity fidelity = Fidelity::kPaper;
  int width = 0;                // h of both hidden layers
  Index counted = 0, used = 0;  // all parameters; those that some stage's loss can reach
  /// Option2Vec of the same fidelity / this, both counted; for the methods with one network an
  /// option.
  std::optional<double> share;
};

/// The tensors that the loss of some stage can reach, by position in Params().
std::vector<char> InAnyGraph(const Algorithm& algorithm);
/// Their entries.
Index CountUsed(Algorithm& algorithm);

/// Every task of the registry and the domains of DeepMind Control (sizes alone; gym's
/// configuration), every method, both fidelities, widths 64 and 128. Option2Vec has a width of its
/// own. Source: spec 2.2 to 2.7.
std::vector<ParamRow> ParamTable();

/// task, S, A, method, fidelity, width, counted, used, share as CSV; share is empty where there is
/// none.
std::string ParamCsv(const std::vector<ParamRow>& rows);

/// The same for the eye, with a note on the paper's 15.8 %. Architectures that the fidelity does
/// not change take one line.
std::string ParamText(const std::vector<ParamRow>& rows);

}  // namespace o2v
