#pragma once
// The folder of a run: held by one process, of one configuration.

#include <filesystem>
#include <optional>
#include <string>

#include "run/manifest.h"

namespace o2v {

/// Holds a run folder for this process; the system lets go when the process ends, however it does.
class FolderLock {
 public:
  /// Throws ConfigError when another process holds it, or when it cannot be locked.
  explicit FolderLock(const std::filesystem::path& dir);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

/// Accepts or refuses a folder that is locked; writes config.toml into a new one. True when the run
/// has ended and nothing is left to do. Throws ConfigError for a folder that is not of this run, or
/// that `resume` does not allow.
bool PrepareFolder(const std::filesystem::path& dir, const std::string& config, bool resume,
                   const std::optional<Manifest>& manifest);

}  // namespace o2v
