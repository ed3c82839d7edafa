#pragma once
// A place for the files of a test.

#include <stdlib.h>

#include <filesystem>
#include <string>

#include "base/check.h"

namespace o2v {

/// An empty folder of its own, gone after the test.
class TestFolder {
 public:
  TestFolder() {
    std::string name = std::filesystem::temp_directory_path() / "o2v-XXXXXX";
    Check(::mkdtemp(name.data()) != nullptr, name, ": cannot be made");
    path_ = name;
  }
  ~TestFolder() { std::filesystem::remove_all(path_); }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace o2v
