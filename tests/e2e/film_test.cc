// The program's films.

#include <gtest/gtest.h>

#include <cstdlib>

#include "program.h"

namespace o2v {
namespace {

using std::string_literals::operator""s;

class Films : public Program {
 protected:
  void SetUp() override { ASSERT_EQ(Train("--out run").code, 0); }
  Outcome Film(const std::string& more) const {
    return Run("film --checkpoint run/last.ckpt --size 64x64 " + more);
  }
  void ExpectNothingHalfDone() const {
    for (const auto& entry : std::filesystem::directory_iterator(dir_.path())) {
      EXPECT_FALSE(IsTemporary(entry.path())) << entry.path();
    }
  }
};

TEST_F(Films, ThatCannotBeMadeAreRefused) {
  for (const char* bad :
       {"--out x.avi", "--out x", "--out nowhere/x.png", "--out x.png --size 64",
        "--out x.png --size 64x65", "--out x.png --size 0x64", "--out x.png --size 64x64x64",
        "--out x.png --task Hopper-v3", "--out x.png --task HalfCheetah-v2",  // of other sizes
        "--out x.png --fps 0", "--out x.png --action none"}) {
    const Outcome outcome = Film(bad);
    EXPECT_EQ(outcome.code, 2) << bad << ": " << outcome.err;
  }
  for (const char* name : {"x", "x.avi", "x.png"}) {
    EXPECT_FALSE(std::filesystem::exists(dir_ / name)) << name;
  }
  ExpectNothingHalfDone();
}

TEST_F(Films, OfOnePictureAreStripsOfSix) {
  const Outcome outcome = Film("--out x.png --seed 3");
  if (outcome.err.find("make deps FILM=1") != std::string::npos) GTEST_SKIP() << outcome.err;
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(ReadFile(dir_ / "x.png").substr(0, 24),
            "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x01\x80\0\0\0\x40"s)
      << "6 times 64, by 64";
  const std::string eval = Run("eval --checkpoint run/last.ckpt --episodes 1 --seed 3").out;
  EXPECT_EQ(outcome.out, eval.substr(0, eval.find('#')) + "# x.png: 6 frames\n")
      << "the same episode";
}

TEST_F(Films, ThatLoseTheirProgramLeaveTheOldOne) {
  WriteFileAtomically(dir_ / "x.mp4", "old");
  WriteFileAtomically(dir_ / "ffmpeg", "#!/bin/sh\necho no space left >&2\nexit 1\n");
  std::filesystem::permissions(dir_ / "ffmpeg", std::filesystem::perms::owner_all);
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", (dir_.path().string() + ":" + path).c_str(), 1);
  const Outcome outcome = Film("--out x.mp4");
  ::setenv("PATH", path.c_str(), 1);
  if (outcome.err.find("make deps FILM=1") != std::string::npos) GTEST_SKIP() << outcome.err;
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.err, "option2vec: x.mp4: ffmpeg ended early: no space left\n");
  EXPECT_EQ(ReadFile(dir_ / "x.mp4"), "old");
  ExpectNothingHalfDone();
}

}  // namespace
}  // namespace o2v
