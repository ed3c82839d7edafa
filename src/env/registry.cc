#include <algorithm>

#include "base/check.h"
#include "base/names.h"
#include "env/env.h"

namespace o2v {

#define O2V_ENV(id, factory, time_limit) \
  std::unique_ptr<Env> factory(const EnvOptions& options, int limit);
#include "env/list.inc"
#undef O2V_ENV

const std::vector<EnvEntry>& EnvRegistry() {
  static const std::vector<EnvEntry> table = {
#define O2V_ENV(id, factory, time_limit) {id, factory, time_limit},
#include "env/list.inc"
#undef O2V_ENV
  };
  return table;
}

std::unique_ptr<Env> MakeEnv(const std::string& id, const EnvOptions& options) {
  std::vector<std::string> known;
  for (const EnvEntry& entry : EnvRegistry()) {
    if (entry.id == id) return entry.make(options, entry.time_limit);
    known.push_back(entry.id);
  }
  throw ConfigError(Concat("unknown task '", id, "'; nearest: ", Nearest(id, known)));
}

}  // namespace o2v
