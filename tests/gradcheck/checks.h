#pragma once
// The list of gradient checks, run by gtest and by the program gradcheck.

#include <functional>
#include <string>
#include <vector>

#include "grad_check.h"

namespace o2v {

struct NamedCheck {
  std::string name;
  std::function<Comparison()> run;
};

/// Layers (src/nn).
std::vector<NamedCheck> NnChecks();
/// Distributions and the losses on their outputs (src/dist, algo/losses.h).
std::vector<NamedCheck> DistChecks();
/// Whole networks and their outputs, every stage, fidelity and switch (src/algo).
std::vector<NamedCheck> AlgoChecks();
/// All of them.
std::vector<NamedCheck> AllChecks();

}  // namespace o2v
