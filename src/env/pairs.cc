#include "env/pairs.h"

#include <sstream>

namespace o2v {

const std::vector<TaskPair>& PairRegistry() {
  static const std::vector<TaskPair> pairs = {
      {"CartPole", "dm-cartpole-balance", "dm-cartpole-balance_sparse"},
      {"Reacher", "dm-reacher-easy", "dm-reacher-hard"},
      {"Cheetah", "dm-cheetah-run", "dm-cheetah-backward"},
      {"Fish", "dm-fish-upright", "dm-fish-downleft"},
      {"Walker1", "dm-walker-squat", "dm-walker-stand"},
      {"Walker2", "dm-walker-walk", "dm-walker-backward"},
  };
  return pairs;
}

std::vector<std::string> SplitTasks(const std::string& text) {
  for (const TaskPair& pair : PairRegistry()) {
    if (pair.name == text) return {pair.first, pair.second};
  }
  std::vector<std::string> ids;
  std::istringstream in(text);
  for (std::string id; std::getline(in, id, ',');) ids.push_back(id);
  // An empty word at the end is a word too: it is unknown, and is reported as such.
  if (text.empty() || text.back() == ',') ids.emplace_back();
  return ids;
}

std::string TasksName(const std::vector<std::string>& ids) {
  for (const TaskPair& pair : PairRegistry()) {
    if (ids == std::vector<std::string>{pair.first, pair.second}) return pair.name;
  }
  return JoinTasks(ids);
}

std::string JoinTasks(const std::vector<std::string>& ids) {
  std::string text;
  for (const std::string& id : ids) text += (text.empty() ? "" : ",") + id;
  return text;
}

}  // namespace o2v
