#include "base/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <optional>
#include <random>
#include <system_error>

#include "base/check.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLinks = 40;  // in a chain; as Linux

std::string Reason() { return std::generic_category().message(errno); }

/// The result of a system call that no signal interrupted.
template <typename Call>
auto Uninterrupted(Call&& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

/// A file descriptor that closes itself.
class Descriptor {
 public:
  Descriptor(const fs::path& path, int flags) : Descriptor(path, flags, path) {}
  /// `name`: what messages call the file.
  Descriptor(const fs::path& path, int flags, const fs::path& name)
      : name_(name),
        fd_(Uninterrupted([&] { return ::open(path.c_str(), flags | O_CLOEXEC, 0644); })) {
    if (fd_ < 0) Fail("cannot open");
  }
  ~Descriptor() { ::close(fd_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int fd() const { return fd_; }
  void Write(std::string_view text) const { WriteAll(fd_, name_.string(), text); }
  void Sync() const {
    if (Uninterrupted([&] { return ::fsync(fd_); }) != 0) Fail("cannot write to the disk");
  }
  [[noreturn]] void Fail(std::string_view what) const {
    throw Error(Concat(name_.string(), ": ", what, ": ", Reason()));
  }

 private:
  fs::path name_;
  int fd_;
};

/// Brings a new name in a folder to the disk. Some file systems sync no folders; that is no error.
void SyncFolder(const fs::path& dir) {
  const Descriptor folder(dir.empty() ? "." : dir, O_RDONLY | O_DIRECTORY);
  if (Uninterrupted([&] { return ::fsync(folder.fd()); }) != 0 && errno != EINVAL) {
    folder.Fail("cannot write to the disk");
  }
}

/// The file at the end of a chain of links, which need not exist.
fs::path FollowLinks(fs::path path) {
  std::error_code error;
  for (int n = 0; fs::is_symlink(path, error); ++n) {
    Check(n < kMostLinks, path.string(), ": too many links");
    path = path.parent_path() / fs::read_symlink(path);
  }
  return path;
}

/// Where the text of a file waits until it is whole: a new file of a name that no other process
/// has, beside the one that it is to replace. Without Rename it goes with the object.
class Temporary {
 public:
  explicit Temporary(const fs::path& target)
      : target_(target),
        path_(NewName(target)),
        file_(path_, O_WRONLY | O_CREAT | O_EXCL, target) {}
  ~Temporary() {
    if (!renamed_) ::unlink(path_.c_str());
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  void Write(std::string_view text) const {
    file_.Write(text);
    file_.Sync();
  }
  void Rename() {
    if (std::rename(path_.c_str(), target_.c_str()) != 0) {
      throw Error(Concat(target_.string(), ": cannot replace: ", Reason()));
    }
    renamed_ = true;
  }

 private:
  /// Process numbers would not do: machines that share a folder have the same ones.
  static fs::path NewName(fs::path path) {
    char digits[kTemporaryEnding + 1];
    std::snprintf(digits, sizeof digits, ".%08x.tmp", std::random_device()());
    return path += digits;
  }

  fs::path target_, path_;
  Descriptor file_;
  bool renamed_ = false;
};

/// The number of an open descriptor that a path such as /dev/stdout stands for. To open the path
/// would start at the beginning of a file that other output has gone to.
std::optional<int> DescriptorNumber(fs::path path) {
  std::error_code error;
  const fs::path own = fs::canonical("/proc/self/fd", error);
  path = fs::absolute(path);
  for (int n = 0; !error && n < kMostLinks; ++n) {  // /dev/stdout is a link to /proc/self/fd/1
    if (const fs::path dir = fs::canonical(path.parent_path(), error); !error && dir == own) {
      const std::string name = path.filename();
      int number = 0;
      const auto [end, bad] = std::from_chars(name.data(), name.data() + name.size(), number);
      if (bad == std::errc() && end == name.data() + name.size()) return number;
    }
    path = path.parent_path() / fs::read_symlink(path, error);
  }
  return std::nullopt;
}

}  // namespace

void OpenStandardStreams() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) >= 0 || errno != EBADF) continue;
    // The lowest free number is this one.
    Check(::open("/dev/null", O_RDWR) == fd, "standard stream ", fd, ": cannot open: ", Reason());
  }
}

fs::path FolderPath(const fs::path& dir) {
  fs::path path = dir.lexically_normal();
  if (std::find(dir.begin(), dir.end(), "..") != dir.end() || path == ".") {
    path = fs::weakly_canonical(fs::absolute(dir));  // ".." of a link is the folder it leads to
  }
  if (!path.has_filename()) path = path.parent_path();
  if (!path.has_filename())
    throw ConfigError(Concat("'", dir.string(), "': not the folder of a run"));
  return path;
}

void RequireWritable(const fs::path& path) {
  try {
    if (IsStream(path)) return;
    const fs::path target = FollowLinks(path);
    std::error_code error;
    if (fs::is_directory(target, error)) throw Error(path.string() + ": is a folder");
    const Temporary file(target);
  } catch (const std::exception& e) {
    throw ConfigError(e.what());
  }
}

bool IsStream(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return DescriptorNumber(path) ||
         (fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status));
}

bool IsTemporary(const fs::path& path) {
  const std::string name = path.filename();
  if (name.size() <= kTemporaryEnding || !name.ends_with(".tmp")) return false;
  const std::string ending = name.substr(name.size() - kTemporaryEnding);
  return ending[0] == '.' && ending.find_first_not_of("0123456789abcdef", 1) == ending.rfind('.');
}

std::string ReadFile(const fs::path& path) {
  const Descriptor file(path, O_RDONLY);
  std::string text;
  std::array<char, 65536> block;
  for (;;) {
    const ssize_t n = Uninterrupted([&] { return ::read(file.fd(), block.data(), block.size()); });
    if (n < 0) file.Fail("cannot read");
    if (n == 0) return text;
    text.append(block.data(), static_cast<std::size_t>(n));
  }
}

void WriteAll(int fd, const std::string& name, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = Uninterrupted([&] { return ::write(fd, text.data(), text.size()); });
    if (n < 0) throw Error(Concat(name, ": cannot write: ", Reason()));
    text.remove_prefix(static_cast<std::size_t>(n));
  }
}

void WriteFileAtomically(const fs::path& path, std::string_view text,
                         const std::function<void()>& before_rename) {
  if (const auto fd = DescriptorNumber(path)) return WriteAll(*fd, path.string(), text);
  if (IsStream(path)) return Descriptor(path, O_WRONLY).Write(text);
  const fs::path target = FollowLinks(path);
  Temporary file(target);
  file.Write(text);
  if (before_rename) before_rename();
  file.Rename();
  SyncFolder(target.parent_path());
}

void AppendToFile(const fs::path& path, std::string_view text) {
  Descriptor(path, O_WRONLY | O_CREAT | O_APPEND).Write(text);
}

void SyncFile(const fs::path& path) { Descriptor(path, O_WRONLY).Sync(); }

}  // namespace o2v
