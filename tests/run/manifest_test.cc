#include "run/manifest.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "fake_run.h"

namespace o2v {
namespace {

TEST(Manifest, IsReadBackAsWritten) {
  TestFolder dir;
  for (const RunStatus status :
       {RunStatus::kRunning, RunStatus::kDone, RunStatus::kDiverged, RunStatus::kStopped}) {
    WriteManifest(dir / "", {status, "2026-01-02T03:04:05Z", "2026-01-02T03:04:06Z", 12, 0.1, 2.5});
    const Manifest read = ReadManifest(dir / "").value();
    EXPECT_EQ(read.status, status);
    EXPECT_EQ(read.start, "2026-01-02T03:04:05Z");
    EXPECT_EQ(read.end, "2026-01-02T03:04:06Z");
    EXPECT_EQ(read.steps, 12);
    EXPECT_EQ(read.wall_seconds, 0.1);
    EXPECT_EQ(read.cpu_seconds, 2.5);
  }
}

TEST(Manifest, OfBeforeThereWereRevisionsIsOfTheFirst) {
  const TestFolder dir;
  Manifest manifest;
  manifest.revision = 3;
  WriteManifest(dir / "", manifest);
  EXPECT_EQ(ReadManifest(dir / "")->revision, 3);
  auto json = nlohmann::json::parse(ReadFile(dir / "manifest.json"));
  json.erase("revision");
  WriteFileAtomically(dir / "manifest.json", json.dump());
  EXPECT_EQ(ReadManifest(dir / "")->revision, 1);
}

TEST(Manifest, NamesBuildAndMachine) {
  TestFolder dir;
  WriteManifest(dir / "", {});
  const auto json = nlohmann::json::parse(ReadFile(dir / "manifest.json"));
  for (const char* key : {"commit", "compiler", "flags", "cpu"}) {
    EXPECT_FALSE(json.at(key).get<std::string>().empty()) << key;
  }
  EXPECT_EQ(json.at("versions").at("mujoco"), PhysicsVersion());
  EXPECT_TRUE(json.at("products") == "v3" || json.at("products") == "v4");
  EXPECT_TRUE(json.at("versions").at("eigen").get<std::string>().starts_with("3."));
}

TEST(Manifest, NamesTheLibraryOfTheSimulatorThatIsLoaded) {
  // The kernel's word for it, and another program's hash.
  std::ifstream maps("/proc/self/maps");
  std::string file;
  for (std::string line; file.empty() && std::getline(maps, line);) {
    const std::size_t path = line.find('/');
    if (line.find("/libmujoco.so") != std::string::npos) file = line.substr(path);
  }
  ASSERT_FALSE(file.empty());
  const TestFolder dir;
  const std::string hash = dir / "hash";
  ASSERT_EQ(std::system(("sha256sum < '" + file + "' > '" + hash + "'").c_str()), 0);
  const auto json = nlohmann::json::parse(ManifestJson({}));
  EXPECT_EQ(json.at("physics").at("file"), file);
  EXPECT_EQ(json.at("physics").at("sha256"), ReadFile(hash).substr(0, 64));
}

TEST(Manifest, MayBeMissing) {
  TestFolder dir;
  EXPECT_FALSE(ReadManifest(dir / "").has_value());
}

TEST(Manifest, ThatCannotBeReadIsRefused) {
  TestFolder dir;
  for (const char* text : {"", "{}", "[1]", "{\"status\": \"asleep\"}", "{\"status\": 1}"}) {
    WriteFileAtomically(dir / "manifest.json", text);
    EXPECT_THROW(ReadManifest(dir / ""), Error) << text;
  }
}

}  // namespace
}  // namespace o2v
