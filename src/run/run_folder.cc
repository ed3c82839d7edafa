#include "run/run_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <sstream>
#include <system_error>

#include "base/check.h"
#include "base/files.h"
#include "run/record.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;

std::string Reason(int error) { return std::generic_category().message(error); }

/// Throws ConfigError with the first line in which the folder's config and the wanted one differ.
void RequireSameConfig(const fs::path& path, const std::string& wanted) {
  std::istringstream a(ReadFile(path)), b(wanted);
  std::string line_a, line_b;
  for (int line = 1;; ++line) {
    const bool more_a = static_cast<bool>(std::getline(a, line_a));
    const bool more_b = static_cast<bool>(std::getline(b, line_b));
    if (!more_a && !more_b) return;
    if (more_a && more_b && line_a == line_b) continue;
    if (line_a == line_b + "\r") {
      throw ConfigError(Concat(path.string(), ":", line, ": ends in CR LF, but the run was ",
                               "started with LF; restore the line ends"));
    }
    throw ConfigError(Concat(path.string(), ":", line, ": this run was started with '",
                             more_a ? line_a : "(nothing)", "', not '",
                             more_b ? line_b : "(nothing)", "'"));
  }
}

}  // namespace

FolderLock::FolderLock(const fs::path& dir) : fd_(::open(dir.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (fd_ < 0) throw ConfigError(Concat(dir.string(), ": cannot be opened: ", Reason(errno)));
  int result = 0;
  do {
    result = ::flock(fd_, LOCK_EX | LOCK_NB);
  } while (result != 0 && errno == EINTR);
  if (result == 0) return;
  const int error = errno;
  ::close(fd_);
  throw ConfigError(Concat(dir.string(), ": ",
                           error == EWOULDBLOCK
                               ? "another process is training in this folder"
                               : "cannot be locked for this process: " + Reason(error)));
}

FolderLock::~FolderLock() { ::close(fd_); }

bool PrepareFolder(const fs::path& dir, const std::string& config, bool resume,
                   const std::optional<Manifest>& manifest) {
  const fs::path path = dir / "config.toml";
  const bool begun = fs::exists(path);
  if (!begun) {
    for (const auto& entry : fs::directory_iterator(dir)) {
      if (!IsTemporary(entry.path())) {
        throw ConfigError(Concat(dir.string(), ": contains ", entry.path().filename().string(),
                                 " but no config.toml: not the folder of a run"));
      }
    }
  }
  const RunStatus status = manifest ? manifest->status : RunStatus::kRunning;
  const bool ended = begun && (status == RunStatus::kDone || status == RunStatus::kDiverged);
  if (begun && !resume) {
    throw ConfigError(
        Concat(dir.string(), ended ? ": this run is " + ToString(status)
                                   : ": contains an unfinished run; use --resume to continue"));
  }
  if (begun) RequireSameConfig(path, config);
  RequireRecordPlace(dir, config, begun);
  RequireWritable(RecordPath(dir, ".json"));
  for (const auto& entry : fs::directory_iterator(dir)) {  // of processes that were killed
    if (IsTemporary(entry.path())) fs::remove(entry.path());
  }
  if (!begun) WriteFileAtomically(path, config);
  return ended;
}

}  // namespace o2v
