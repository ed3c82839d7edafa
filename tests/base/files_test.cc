#include "base/files.h"

#include <gtest/gtest.h>

#include "base/check.h"
#include "test_folder.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;

class Files : public testing::Test {
 protected:
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
    EXPECT_EQ(ReadFile(dir_ / "x.tmp"), "new");
  });
  EXPECT_EQ(ReadFile(dir_ / "x"), "new");
  EXPECT_FALSE(fs::exists(dir_ / "x.tmp"));
}

TEST_F(Files, ReplaceALongerLeftover) {
  WriteFileAtomically(dir_ / "x.tmp", "left over by a killed run");
  WriteFileAtomically(dir_ / "x", "new");
  EXPECT_EQ(ReadFile(dir_ / "x"), "new");
}

TEST_F(Files, NameFileAndReasonWhenTheyCannotBeRead) {
  EXPECT_EQ(MessageOf([&] { ReadFile(dir_ / "none"); }),
            (dir_ / "none").string() + ": cannot open: No such file or directory");
  EXPECT_EQ(MessageOf([&] { ReadFile(dir_ / ""); }),
            (dir_ / "").string() + ": cannot read: Is a directory");
}

TEST_F(Files, NameFileAndReasonWhenTheyCannotBeWritten) {
  EXPECT_EQ(MessageOf([&] { WriteFileAtomically(dir_ / "none" / "x", ""); }),
            (dir_ / "none" / "x.tmp").string() + ": cannot open: No such file or directory");
  fs::create_directories(dir_ / "x" / "y");
  EXPECT_EQ(MessageOf([&] { WriteFileAtomically(dir_ / "x", ""); }),
            (dir_ / "x").string() + ": cannot replace: Is a directory");
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

}  // namespace
}  // namespace o2v
