#pragma once
// What the fuzz targets share. libFuzzer calls LLVMFuzzerTestOneInput with bytes of its own
// making; a crash, a leak, a hang, or an exception other than Error is a find.

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/check.h"

namespace o2v {

/// A file that lives in memory: reading it costs no disk.
class MemoryFile {
 public:
  MemoryFile() : fd_(::memfd_create("input", MFD_CLOEXEC)) { Check(fd_ >= 0, "no memfd"); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(fd_); }

  /// The path of a file of these bytes, valid until the next call.
  std::filesystem::path Holding(std::string_view bytes) {
    Check(::ftruncate(fd_, 0) == 0 &&
              ::pwrite(fd_, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()),
          "memfd: cannot write");
    return "/proc/self/fd/" + std::to_string(fd_);
  }

 private:
  int fd_;
};

inline std::string_view Bytes(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Calls `use` and says whether it returned. Takes Error; any other exception ends the program.
template <typename Use>
bool Accepts(Use&& use) {
  try {
    use();
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// Ends the program as a find of the fuzzer.
inline void Expect(bool ok) {
  if (!ok) __builtin_trap();
}

}  // namespace o2v
