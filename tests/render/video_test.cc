#include "render/video.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "base/check.h"
#include "base/files.h"
#include "test_folder.h"

namespace o2v {
namespace {

namespace fs = std::filesystem;
using std::string_literals::operator""s;

class Videos : public testing::Test {
 protected:
  /// A program of shell in the place of ffmpeg; $file is what it should write.
  std::string Fake(const std::string& text) const {
    const fs::path path = dir_ / "fake";
    WriteFileAtomically(path, "#!/bin/sh\nfor file; do :; done\nfile=${file#file:}\n" + text);
    fs::permissions(path, fs::perms::owner_all);
    return path.string();
  }
  /// A frame of 2 x 1 pixels.
  static Image Frame(unsigned char value) { return {2, 1, std::vector<unsigned char>(6, value)}; }
  /// Files in the folder, but for the program.
  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(dir_.path())) {
      if (entry.path().filename() != "fake") names.push_back(entry.path().filename());
    }
    return names;
  }
  std::string Refused(const std::string& text, int frames) const {
    try {
      Video video(dir_ / "x.mp4", 2, 1, 20, Fake(text));
      for (int i = 0; i < frames; ++i) video.Write(Frame(1));
      video.Finish();
    } catch (const Error& e) {
      return std::string(e.what()).substr((dir_ / "x.mp4").string().size());
    }
    return "accepted";
  }

  TestFolder dir_;
};

TEST_F(Videos, AreWhatTheProgramMakesOfTheFrames) {
  Video video(dir_ / "x.mp4", 2, 1, 20, Fake("exec cat > \"$file\"\n"));
  video.Write(Frame('a'));
  video.Write(Frame('b'));
  EXPECT_FALSE(fs::exists(dir_ / "x.mp4")) << "not before the end";
  video.Finish();
  EXPECT_EQ(ReadFile(dir_ / "x.mp4"), "aaaaaabbbbbb");
  EXPECT_EQ(Files(), std::vector{"x.mp4"s});
}

TEST_F(Videos, ThatFailLeaveNothingAndSayWhy) {
  EXPECT_EQ(Refused("echo No space left >&2; exit 3\n", 1000),
            ": ffmpeg ended early: No space left");
  EXPECT_EQ(Refused("echo half > \"$file\"; cat > /dev/null; kill -9 $$\n", 3),
            ": ffmpeg ended early, by signal 9");
  EXPECT_EQ(Refused("cat > /dev/null\n", 3), ": ffmpeg ended early") << "wrote nothing";
  EXPECT_EQ(Files(), std::vector<std::string>{});
}

TEST_F(Videos, ThatDoNotFitTheDiskSaySo) {
  fs::create_symlink("/dev/full", dir_ / "x.mp4");
  EXPECT_EQ(Refused("cat > \"$file\"\n", 3), ": cannot write: No space left on device");
  EXPECT_EQ(Files(), std::vector{"x.mp4"s});
}

TEST_F(Videos, ThatAreGivenUpLeaveNothing) {
  { Video(dir_ / "x.gif", 2, 1, 20, Fake("cat > \"$file\"\n")).Write(Frame(1)); }
  EXPECT_EQ(Files(), std::vector<std::string>{});
}

TEST_F(Videos, KeepTheFileThatTheyFailToReplace) {
  WriteFileAtomically(dir_ / "x.mp4", "before");
  EXPECT_NE(Refused("exit 1\n", 1), "accepted");
  EXPECT_EQ(ReadFile(dir_ / "x.mp4"), "before");
}

TEST_F(Videos, NeedAProgramAPlaceAndAName) {
  EXPECT_THROW(Video(dir_ / "x.mp4", 2, 1, 20, "no-such-program-of-films"), ConfigError);
  EXPECT_THROW(Video(dir_ / "nowhere" / "x.mp4", 2, 1, 20, Fake("")), ConfigError);
  EXPECT_THROW(Video(dir_ / "x.avi", 2, 1, 20, Fake("")), ConfigError);
  EXPECT_THROW(RequireVideoName("x"), ConfigError);
  for (const char* name : {"a.mp4", "a.gif", "a.b.png"}) RequireVideoName(name);
  EXPECT_EQ(Files(), std::vector<std::string>{});
}

TEST_F(Videos, TakeFramesOfTheirSizeOnly) {
  Video video(dir_ / "x.mp4", 1, 2, 20, Fake("cat > /dev/null\n"));
  EXPECT_THROW(video.Write(Frame(1)), Error);
}

TEST_F(Videos, OfTheRealProgramHaveTheirFormats) {
  if (std::system("ffmpeg -version > /dev/null 2>&1") != 0) GTEST_SKIP() << "no ffmpeg";
  const Image red = {64, 32, [] {
                       std::vector<unsigned char> rgb(3 * 64 * 32, 0);
                       for (std::size_t i = 0; i < rgb.size(); i += 3) rgb[i] = 255;
                       return rgb;
                     }()};
  for (const char* name : {"x.mp4", "x.gif", "x.png"}) {
    Video video(dir_ / name, 64, 32, 20);
    for (int i = 0; i < 3; ++i) video.Write(red);
    video.Finish();
  }
  // Signatures; of PNG also width and height, big-endian, in its first chunk.
  EXPECT_EQ(ReadFile(dir_ / "x.mp4").substr(4, 4), "ftyp");
  EXPECT_EQ(ReadFile(dir_ / "x.gif").substr(0, 10), "GIF89a\x40\0\x20\0"s);
  EXPECT_EQ(ReadFile(dir_ / "x.png").substr(0, 24),
            "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x40\0\0\0\x20"s);
}

TEST(Strips, AreImagesSideBySide) {
  const Image a = {1, 2, {1, 2, 3, 4, 5, 6}}, b = {2, 2, {7, 7, 7, 8, 8, 8, 9, 9, 9, 0, 0, 0}};
  const Image strip = Strip({a, b});
  EXPECT_EQ(strip.width, 3);
  EXPECT_EQ(strip.height, 2);
  EXPECT_EQ(strip.rgb, (std::vector<unsigned char>{1, 2, 3, 7, 7, 7, 8, 8, 8,  //
                                                   4, 5, 6, 9, 9, 9, 0, 0, 0}));
}

}  // namespace
}  // namespace o2v
