#pragma once
// Runs over more than one task: transfer pairs and their names.

#include <string>
#include <vector>

namespace o2v {

/// A run that goes on from one task to the next. Sizes of observation and action are equal.
struct TaskPair {
  std::string name;  // "Cheetah"
  std::string first, second;
};

/// The transfer pairs. Source: spec E.4.
const std::vector<TaskPair>& PairRegistry();

/// "Cheetah" or "dm-cheetah-run,dm-cheetah-backward" -> the ids in order; an id -> itself. The ids
/// are not looked up.
std::vector<std::string> SplitTasks(const std::string& text);
/// The name of the pair that consists of these tasks; the ids joined by commas when there is none.
std::string TasksName(const std::vector<std::string>& ids);
/// The ids joined by commas.
std::string JoinTasks(const std::vector<std::string>& ids);

}  // namespace o2v
