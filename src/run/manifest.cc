#include "run/manifest.h"

#include <Eigen/Core>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>

#include "base/check.h"
#include "base/files.h"
#include "base/printable.h"
#include "build_info.h"
#include "env/env.h"
#include "nn/isa.h"

namespace o2v {
namespace {

using nlohmann::ordered_json;

constexpr std::array<const char*, 4> kStatusNames = {"running", "done", "diverged", "stopped"};

/// "model name" of the first processor.
std::string CpuModel() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

ordered_json Build() {
  return {
      {"commit", kBuildCommit},
      {"compiler", kBuildCompiler},
      {"flags", kBuildFlags},
      {"versions",
       {{"eigen", Concat(EIGEN_WORLD_VERSION, '.', EIGEN_MAJOR_VERSION, '.', EIGEN_MINOR_VERSION)},
        {"mujoco", PhysicsVersion()}}}};
}

}  // namespace

std::string ToString(RunStatus status) { return kStatusNames[static_cast<std::size_t>(status)]; }

RunStatus ParseStatus(const std::string& name) {
  for (std::size_t i = 0; i < kStatusNames.size(); ++i) {
    if (name == kStatusNames[i]) return static_cast<RunStatus>(i);
  }
  throw Error("unknown status '" + name + "'");
}

std::string VersionText() {
  const ordered_json build = Build();
  std::string text;
  for (const char* key : {"commit", "compiler", "flags"}) {
    text += Concat(key, ' ', build.at(key).get<std::string>(), '\n');
  }
  for (const auto& [name, version] : build.at("versions").items()) {
    text += Concat(name, ' ', version.get<std::string>(), '\n');
  }
  const PhysicsLibrary& physics = LoadedPhysics();
  return text + Concat("products ", ToString(ChosenIsa()), "\nphysics ", Printable(physics.file),
                       " SHA-256 ", physics.sha256);
}

std::string BuildJson() { return Build().dump(2) + "\n"; }

std::string ManifestJson(const Manifest& manifest) {
  const PhysicsLibrary& physics = LoadedPhysics();
  ordered_json out = {{"status", ToString(manifest.status)},
                      {"start", manifest.start},
                      {"end", manifest.end},
                      {"steps", manifest.steps},
                      {"wall_seconds", manifest.wall_seconds},
                      {"cpu_seconds", manifest.cpu_seconds},
                      {"cpu", CpuModel()},
                      {"products", ToString(ChosenIsa())},
                      {"physics", {{"file", physics.file}, {"sha256", physics.sha256}}},
                      {"revision", manifest.revision}};
  out.update(Build());
  // A file's name may be any bytes.
  return out.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

void WriteManifest(const std::filesystem::path& dir, const Manifest& manifest) {
  WriteFileAtomically(dir / "manifest.json", ManifestJson(manifest));
}

std::optional<Manifest> ReadManifest(const std::filesystem::path& dir) {
  const std::filesystem::path path = dir / "manifest.json";
  if (!std::filesystem::exists(path)) return std::nullopt;
  try {
    const ordered_json in = ordered_json::parse(ReadFile(path));
    Manifest manifest;
    manifest.status = ParseStatus(in.at("status").get<std::string>());
    manifest.start = in.at("start").get<std::string>();
    manifest.end = in.at("end").get<std::string>();
    manifest.steps = in.at("steps").get<std::int64_t>();
    manifest.wall_seconds = in.at("wall_seconds").get<double>();
    manifest.cpu_seconds = in.at("cpu_seconds").get<double>();
    manifest.revision = in.value("revision", 1);
    return manifest;
  } catch (const std::exception& e) {
    throw Error(Concat(path.string(), ": cannot be read: ", e.what()));
  }
}

}  // namespace o2v
