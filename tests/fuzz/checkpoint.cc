// Checkpoints of a small method: metadata, policy, whole state. What a file that is accepted brings
// must be fit to act on.
//
// The first byte of the input chooses: 0, the rest is the file; else the rest are edits of a whole
// one, each {place (2 bytes), number of bytes to drop, number of bytes to put in, these}. A file
// whose only fault is its checksum is tried once more with the right one: damage behind it counts.

#include "run/checkpoint.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "base/files.h"
#include "env/env.h"
#include "fuzz/target.h"
#include "rollout/vec_env.h"
#include "run/config.h"
#include "run/trainer.h"
#include "test_folder.h"

namespace o2v {
namespace {

RunConfig SmallRun() {
  RunRequest request;
  request.task = "InvertedPendulum-v2";
  request.algorithm = "dac_ppo";
  request.steps = 64;
  request.set = {"workers=2", "hidden=2", "options=2", "rollout=4", "minibatch=4", "epochs=1"};
  return ResolveRun(request);
}

/// A run without a folder.
struct State {
  State() { env.Reset(); }

  StateWalk Walk() {
    return [this](StateVisitor& v) {
      algorithm->Serialize(v);
      env.Serialize(v);
    };
  }

  RunConfig config = SmallRun();
  RunParts parts = PartsOf(config);
  VecEnv env{[this] { return parts.make_env(0); }, config.workers, /*seed=*/1};
  std::unique_ptr<Algorithm> algorithm = parts.make_algorithm(env.Spec());
};

std::string WholeFile(State& state) {
  TestFolder folder;
  SaveCheckpoint(folder / "x", {{"config", ToToml(state.config)}, {"total_steps", "0"}},
                 *state.algorithm, state.Walk());
  return ReadFile(folder / "x");
}

std::string Edited(std::string file, std::string_view edits) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(edits[i]); };
  while (edits.size() >= 4) {
    const std::size_t place = (byte(0) + 256u * byte(1)) % (file.size() + 1);
    const std::size_t drop = byte(2);
    const std::string_view put = edits.substr(4, byte(3));
    file.replace(place, drop, put);
    edits.remove_prefix(4 + put.size());
  }
  return file;
}

/// Puts in the checksum that the refusal asks for; false when it asks for something else.
bool MendChecksum(std::string& file, const std::string& refusal) {
  constexpr std::string_view kFound = "checksum ", kGiven = ", not '";
  const std::size_t found = refusal.find(kFound), given = refusal.find(kGiven);
  if (found == std::string::npos || given == std::string::npos) return false;
  const std::size_t start = found + kFound.size();
  std::string wrong = refusal.substr(given + kGiven.size());
  wrong.erase(std::min(wrong.find('\''), wrong.size()));
  const std::size_t at = file.find(wrong);
  if (wrong.empty() || at == std::string::npos) return false;
  file.replace(at, wrong.size(), refusal.substr(start, given - start));
  return true;
}

void Try(std::string_view input) {
  static State state;
  static const std::string whole = WholeFile(state);
  static MemoryFile memory;
  static Normalizer normalizer(state.env.Spec().S);
  if (input.empty()) return;
  std::string file = input[0] ? Edited(whole, input.substr(1)) : std::string(input.substr(1));
  try {
    ReadMetadata(memory.Holding(file));
  } catch (const Error& e) {
    if (!MendChecksum(file, e.what())) return;
  }
  const std::filesystem::path path = memory.Holding(file);
  Accepts([&] { TotalSteps(ReadMetadata(path)); });
  Accepts([&] { LoadPolicy(path, *state.algorithm, normalizer); });
  Accepts([&] {
    LoadCheckpoint(path, *state.algorithm, state.Walk());
    std::vector<Episode> episodes;
    state.algorithm->Collect(state.env, episodes);
    state.algorithm->Update();
  });
}

}  // namespace
}  // namespace o2v

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  o2v::Try(o2v::Bytes(data, size));
  return 0;
}
