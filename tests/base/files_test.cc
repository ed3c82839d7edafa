#include "base/files.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <functional>
#include <vector>

#include "base/check.h"
#include "test_folder.h"

namespace {
int interruptions = 0;                   // reads and writes that a signal is to interrupt
std::function<void(bool)> before_fsync;  // told whether it is a folder's
}  // namespace

// The program's own calls, in front of the system's. A write takes seven bytes at most.
extern "C" ssize_t read(int fd, void* data, size_t n) {
  if (interruptions > 0 && --interruptions >= 0) return errno = EINTR, -1;
  return syscall(SYS_read, fd, data, n);
}
extern "C" ssize_t write(int fd, const void* data, size_t n) {
  if (interruptions > 0 && --interruptions >= 0) return errno = EINTR, -1;
  return syscall(SYS_write, fd, data, std::min<size_t>(n, 7));
}
extern "C" int fsync(int fd) {
  struct stat status {};
  ::fstat(fd, &status);
  if (before_fsync) before_fsync(S_ISDIR(status.st_mode));
  return int(syscall(SYS_fsync, fd));
}

namespace o2v {
namespace {

namespace fs = std::filesystem;

class Files : public testing::Test {
 protected:
  std::vector<fs::path> Temporaries() const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(dir_.path())) {
      if (IsTemporary(entry.path())) found.push_back(entry.path());
    }
    return found;
  }

  TestFolder dir_;
};

template <typename Action>
std::string MessageOf(Action&& action) {
  try {
    action();
  } catch (const Error& e) {
    return e.what();
  }
  return "nothing thrown";
}

TEST_F(Files, AreReadBackAsWritten) {
  std::string text(200'000, '\0');
  for (std::size_t i = 0; i < text.size(); ++i) text[i] = static_cast<char>(i * 7);
  WriteFileAtomically(dir_ / "x", text);
  EXPECT_TRUE(ReadFile(dir_ / "x") == text);
}

TEST_F(Files, StayWholeUntilTheRename) {
  WriteFileAtomically(dir_ / "x", "old");
  WriteFileAtomically(dir_ / "x", "new", [&] {
    EXPECT_EQ(ReadFile(dir_ / "x"), "old");
    const fs::path waiting = Temporaries().at(0);
    EXPECT_TRUE(waiting.filename().string().starts_with("x."));
    EXPECT_EQ(ReadFile(waiting), "new");
  });
  EXPECT_EQ(ReadFile(dir_ / "x"), "new");
  EXPECT_TRUE(Temporaries().empty());
}

TEST_F(Files, WrittenByTwoAtOnceAreOneOfTheTexts) {
  const std::string first(100, '1'), second(50, '2');
  WriteFileAtomically(dir_ / "x", first, [&] {
    WriteFileAtomically(dir_ / "x", second, [&] {
      const std::vector<fs::path> waiting = Temporaries();
      ASSERT_EQ(waiting.size(), 2u);
      EXPECT_EQ(ReadFile(waiting[0]).size() + ReadFile(waiting[1]).size(), 150u);
    });
    EXPECT_EQ(ReadFile(dir_ / "x"), second);
  });
  EXPECT_EQ(ReadFile(dir_ / "x"), first);
  EXPECT_TRUE(Temporaries().empty());
}

TEST_F(Files, AreNeverWrittenThroughANameThatIsTaken) {
  AppendToFile(dir_ / "mine", "kept");
  fs::create_symlink("mine", dir_ / "x.tmp");
  WriteFileAtomically(dir_ / "x", "new");
  EXPECT_EQ(ReadFile(dir_ / "mine"), "kept");
}

TEST_F(Files, LeaveNothingBehindWhenTheyFail) {
  const auto fail = [] { throw Error("stopped"); };
  EXPECT_THROW(WriteFileAtomically(dir_ / "x", "text", fail), Error);
  struct rlimit before {};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const rlimit ten{10, before.rlim_max};
  ::signal(SIGXFSZ, SIG_IGN);
  ::setrlimit(RLIMIT_FSIZE, &ten);
  const std::string message = MessageOf([&] { WriteFileAtomically(dir_ / "x", "eleven byte"); });
  ::setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(message, (dir_ / "x").string() + ": cannot write: File too large");
  EXPECT_TRUE(fs::is_empty(dir_.path()));
}

TEST_F(Files, CanBeReadByWhomTheMaskAllows) {
  const mode_t before = ::umask(027);
  WriteFileAtomically(dir_ / "x", "text");
  ::umask(before);
  EXPECT_EQ(fs::status(dir_ / "x").permissions(), fs::perms(0640));
}

TEST_F(Files, ThatAreNotWholeAreKnownByTheirNames) {
  EXPECT_TRUE(IsTemporary("run/last.ckpt.0189abef.tmp"));
  for (const char* name : {"last.ckpt.tmp", "last.ckpt.0189abe.tmp", "last.ckpt.0189abeg.tmp",
                           "last.ckpt_0189abef.tmp", ".0189abef.tmp", "last.ckpt.0189abef.csv"}) {
    EXPECT_FALSE(IsTemporary(name)) << name;
  }
}

TEST_F(Files, NameFileAndReasonWhenTheyCannotBeRead) {
  EXPECT_EQ(MessageOf([&] { ReadFile(dir_ / "none"); }),
            (dir_ / "none").string() + ": cannot open: No such file or directory");
  EXPECT_EQ(MessageOf([&] { ReadFile(dir_ / ""); }),
            (dir_ / "").string() + ": cannot read: Is a directory");
}

TEST_F(Files, NameFileAndReasonWhenTheyCannotBeWritten) {
  EXPECT_EQ(MessageOf([&] { WriteFileAtomically(dir_ / "none" / "x", ""); }),
            (dir_ / "none" / "x").string() + ": cannot open: No such file or directory");
  fs::create_directories(dir_ / "x" / "y");
  EXPECT_EQ(MessageOf([&] { WriteFileAtomically(dir_ / "x", ""); }),
            (dir_ / "x").string() + ": cannot replace: Is a directory");
  EXPECT_TRUE(Temporaries().empty());
}

TEST_F(Files, NameFileAndReasonWhenTheyCannotBeSynced) {
  WriteFileAtomically(dir_ / "x", "text");
  SyncFile(dir_ / "x");
  EXPECT_EQ(ReadFile(dir_ / "x"), "text");
  EXPECT_EQ(MessageOf([&] { SyncFile(dir_ / "none"); }),
            (dir_ / "none").string() + ": cannot open: No such file or directory");
  EXPECT_EQ(MessageOf([] { SyncFile("/dev/null"); }),  // no disk behind it
            "/dev/null: cannot write to the disk: Invalid argument");
}

TEST_F(Files, OutliveSignalsAndShortWrites) {
  interruptions = 3;
  WriteFileAtomically(dir_ / "x", "twenty bytes of text");
  EXPECT_EQ(interruptions, 0);
  interruptions = 2;
  EXPECT_EQ(ReadFile(dir_ / "x"), "twenty bytes of text");
  EXPECT_EQ(interruptions, 0);
  interruptions = 1;
  AppendToFile(dir_ / "x", ", and more");
  EXPECT_EQ(ReadFile(dir_ / "x"), "twenty bytes of text, and more");
}

TEST_F(Files, AreOnTheDiskBeforeTheyAreRenamedAndTheirFolderAfter) {
  std::string order;
  before_fsync = [&](bool folder) {
    order += folder ? "folder" : "file";
    order += fs::exists(dir_ / "x") ? " after " : " before ";
  };
  WriteFileAtomically(dir_ / "x", "text", [&] { order += "rename "; });
  before_fsync = nullptr;
  EXPECT_EQ(order, "file before rename folder after ");
}

TEST_F(Files, BehindALinkAreReplacedAndTheLinkStays) {
  fs::create_directory(dir_ / "there");
  fs::create_symlink("there/x", dir_ / "near");
  fs::create_symlink("near", dir_ / "link");
  for (const char* text : {"made", "replaced"}) {
    WriteFileAtomically(dir_ / "link", text);
    EXPECT_TRUE(fs::is_symlink(dir_ / "link") && fs::is_symlink(dir_ / "near"));
    EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(dir_ / "there" / "x")));
    EXPECT_EQ(ReadFile(dir_ / "there" / "x"), text);
  }
  fs::create_symlink("loop", dir_ / "loop");
  EXPECT_EQ(MessageOf([&] { WriteFileAtomically(dir_ / "loop", ""); }),
            (dir_ / "loop").string() + ": too many links");
}

TEST_F(Files, ThatAreDevicesOrPipesAreWrittenInto) {
  fs::create_symlink("/dev/null", dir_ / "null");
  WriteFileAtomically(dir_ / "null", "text");
  EXPECT_TRUE(fs::is_character_file("/dev/null") && fs::is_symlink(dir_ / "null"));
  fs::create_symlink("/dev/full", dir_ / "full");
  EXPECT_EQ(MessageOf([&] { WriteFileAtomically(dir_ / "full", "text"); }),
            (dir_ / "full").string() + ": cannot write: No space left on device");
  const fs::path fifo = dir_ / "fifo";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  const int reader = ::open(fifo.c_str(), O_RDONLY | O_NONBLOCK);
  WriteFileAtomically(fifo, "text");
  char text[9] = "";
  EXPECT_EQ(::read(reader, text, 8), 4);
  EXPECT_STREQ(text, "text");
  ::close(reader);
  EXPECT_TRUE(fs::is_fifo(fifo));
  for (const char* name : {"null", "full", "fifo"}) EXPECT_TRUE(IsStream(dir_ / name)) << name;
  EXPECT_FALSE(IsStream(dir_ / "none"));
  EXPECT_FALSE(IsStream(dir_ / ""));
}

TEST_F(Files, NamedAsADescriptorContinueWhatWasWritten) {
  const int fd = ::open((dir_ / "x").c_str(), O_RDWR | O_CREAT, 0600);
  ASSERT_EQ(::write(fd, "first ", 6), 6);
  fs::create_symlink("/dev/fd/" + std::to_string(fd), dir_ / "link");
  WriteFileAtomically("/dev/fd/" + std::to_string(fd), "second ");
  WriteFileAtomically(dir_ / "link", "third");
  ::close(fd);
  EXPECT_EQ(ReadFile(dir_ / "x"), "first second third");
}

TEST_F(Files, CanBeAskedWhetherTheyCanBeWritten) {
  RequireWritable(dir_ / "x");
  WriteFileAtomically(dir_ / "y", "kept");
  RequireWritable(dir_ / "y");
  EXPECT_EQ(ReadFile(dir_ / "y"), "kept");
  EXPECT_EQ(std::distance(fs::directory_iterator(dir_ / ""), fs::directory_iterator()), 1);
  EXPECT_THROW(RequireWritable(dir_ / ""), ConfigError);
  EXPECT_THROW(RequireWritable("/proc/o2v.csv"), ConfigError);
  RequireWritable(dir_ / std::string(242, 'n'));
  EXPECT_EQ(MessageOf([&] { RequireWritable(dir_ / std::string(243, 'n')); }),
            (dir_ / std::string(243, 'n')).string() + ": cannot open: File name too long");
}

TEST_F(Files, FoldersHaveOneName) {
  for (const char* path : {"run", "run/", "run//", "./run", "run/.", "./run/./"}) {
    EXPECT_EQ(FolderPath(path).string(), "run") << path;
  }
  EXPECT_EQ(FolderPath("a/./b/").string(), "a/b");
  EXPECT_EQ(FolderPath("/a/b/").string(), "/a/b");
  const fs::path here = fs::current_path();
  for (const char* path : {".", "./", "././"}) EXPECT_EQ(FolderPath(path), here) << path;
  EXPECT_EQ(FolderPath(".."), here.parent_path());
  EXPECT_EQ(FolderPath("run/.."), here);
  EXPECT_EQ(FolderPath("new/../run"), here / "run");
  // A link's "..": where the link leads to, not where it stands.
  fs::create_directories(dir_ / "a" / "b");
  fs::create_symlink("a/b", dir_ / "link");
  EXPECT_EQ(FolderPath(dir_ / "link" / ".."), fs::canonical(dir_ / "a"));
  EXPECT_EQ(MessageOf([] { FolderPath(""); }), "'': not the folder of a run");
  EXPECT_EQ(MessageOf([] { FolderPath("/"); }), "'/': not the folder of a run");
}

}  // namespace
}  // namespace o2v
