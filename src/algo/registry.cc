#include "algo/algorithm.h"
#include "base/check.h"
#include "base/names.h"

namespace o2v {

#define O2V_ALGO(id, name, make, revision) std::unique_ptr<Algorithm> make(const AlgorithmInput&);
#include "algo/list.inc"
#undef O2V_ALGO

const std::vector<AlgorithmEntry>& AlgorithmRegistry() {
  static const std::vector<AlgorithmEntry> registry = {
#define O2V_ALGO(id, name, make, revision) {id, name, make, revision},
#include "algo/list.inc"
#undef O2V_ALGO
  };
  return registry;
}

const AlgorithmEntry& FindAlgorithm(const std::string& id) {
  std::vector<std::string> known;
  for (const AlgorithmEntry& entry : AlgorithmRegistry()) {
    if (entry.id == id) return entry;
    known.push_back(entry.id);
  }
  throw ConfigError(Concat("unknown algorithm '", id, "'; nearest: ", Nearest(id, known)));
}

std::unique_ptr<Algorithm> MakeAlgorithm(const std::string& id, const AlgorithmInput& input) {
  return FindAlgorithm(id).make(input);
}

}  // namespace o2v
