// oracles DIR: compares the program with every *.json of a folder, one line a file.
// Exit code: 0 all within the bounds, 1 a deviation or an unreadable file, 2 wrong usage.

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <vector>

#include "oracles/oracle.h"

namespace o2v {
namespace {

bool Exists(const std::string& method) {
  return std::any_of(AlgorithmRegistry().begin(), AlgorithmRegistry().end(),
                     [&](const AlgorithmEntry& entry) { return entry.id == method; });
}

/// Prints the line of one file; false when it fails.
bool Report(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  try {
    const nlohmann::json file = ReadOracle(path);
    if (const std::string method = OracleFileMethod(file); !Exists(method)) {
      std::printf("%-36s skipped: there is no method %s yet\n", name.c_str(), method.c_str());
      return true;
    }
    const Comparison result = CompareOracle(file);
    std::printf("%-36s %s  %zu numbers, largest deviation %.1e (bound %.0e) at %s\n", name.c_str(),
                result.Passed() ? "PASS" : "FAIL", result.count(), result.deviation(),
                result.bound(), result.where().c_str());
    return result.Passed();
  } catch (const std::exception& error) {
    std::printf("%-36s FAIL  %s\n", name.c_str(), error.what());
    return false;
  }
}

int Main(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  if (error || files.empty()) {
    std::fprintf(stderr, "oracles: no *.json in '%s'\n", folder.c_str());
    return 1;
  }
  std::sort(files.begin(), files.end());
  bool passed = true;
  for (const auto& path : files) passed &= Report(path);
  return passed ? 0 : 1;
}

}  // namespace
}  // namespace o2v

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: oracles DIR\n");
    return 2;
  }
  return o2v::Main(argv[1]);
}
