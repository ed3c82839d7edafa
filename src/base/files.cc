#include "base/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <system_error>

#include "base/check.h"

namespace o2v {
namespace {

/// A file descriptor that closes itself.
class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags)
      : path_(path), fd_(::open(path.c_str(), flags | O_CLOEXEC, 0644)) {
    if (fd_ < 0) Fail("cannot open");
  }
  ~Descriptor() { ::close(fd_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int fd() const { return fd_; }
  [[noreturn]] void Fail(std::string_view what) const {
    throw Error(Concat(path_.string(), ": ", what, ": ", std::generic_category().message(errno)));
  }

 private:
  std::filesystem::path path_;
  int fd_;
};

void Sync(const Descriptor& file) {
  if (::fsync(file.fd()) != 0) file.Fail("cannot write to the disk");
}

}  // namespace

std::string ReadFile(const std::filesystem::path& path) {
  const Descriptor file(path, O_RDONLY);
  std::string text;
  std::array<char, 65536> block;
  for (;;) {
    const ssize_t n = ::read(file.fd(), block.data(), block.size());
    if (n < 0) file.Fail("cannot read");
    if (n == 0) return text;
    text.append(block.data(), static_cast<std::size_t>(n));
  }
}

void WriteFileAtomically(const std::filesystem::path& path, std::string_view text,
                         const std::function<void()>& before_rename) {
  std::filesystem::path temporary = path;
  temporary += ".tmp";
  {
    const Descriptor file(temporary, O_WRONLY | O_CREAT | O_TRUNC);
    while (!text.empty()) {
      const ssize_t n = ::write(file.fd(), text.data(), text.size());
      if (n < 0) file.Fail("cannot write");
      text.remove_prefix(static_cast<std::size_t>(n));
    }
    Sync(file);
  }
  if (before_rename) before_rename();
  if (std::rename(temporary.c_str(), path.c_str()) != 0) {
    throw Error(
        Concat(path.string(), ": cannot replace: ", std::generic_category().message(errno)));
  }
}

void SyncFile(const std::filesystem::path& path) { Sync(Descriptor(path, O_WRONLY)); }

}  // namespace o2v
