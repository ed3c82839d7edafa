#pragma once
// manifest.json of a run folder: all that depends on the clock, the machine or the build.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace o2v {

/// `running` is also what a killed run leaves behind.
enum class RunStatus { kRunning, kDone, kDiverged, kStopped };
std::string ToString(RunStatus status);
/// Throws Error for an unknown name.
RunStatus ParseStatus(const std::string& name);

/// What changes from run to run; commit, compiler, flags, versions and host are added when written.
struct Manifest {
  RunStatus status = RunStatus::kRunning;
  std::string start, end;   // UTC, ISO 8601; end is empty while running
  std::int64_t steps = 0;   // environment steps of all workers
  double wall_seconds = 0;  // over all processes that worked on the run
  double cpu_seconds = 0;
  int revision = 1;  // of the method's code
};

/// What this program was built from, a JSON object: commit, compiler, flags, versions.
std::string BuildJson();
/// Commit, compiler, flags, versions, instruction set of products and the simulator's library, one
/// a line.
std::string VersionText();
/// Text of a manifest.json.
std::string ManifestJson(const Manifest& manifest);
/// Writes `dir`/manifest.json.
void WriteManifest(const std::filesystem::path& dir, const Manifest& manifest);
/// The manifest of a run folder, nothing when it has none. Throws Error when it cannot be read.
std::optional<Manifest> ReadManifest(const std::filesystem::path& dir);

}  // namespace o2v
