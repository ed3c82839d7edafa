#pragma once
// Films and pictures, written by the program ffmpeg through a pipe.

#include <sys/types.h>

#include <filesystem>
#include <string>

#include "render/renderer.h"

namespace o2v {

/// Throws ConfigError, which says what there is, unless a path ends in .mp4, .gif or .png.
void RequireVideoName(const std::filesystem::path& path);

/// One file. It is there, and whole, after Finish; without it nothing is left behind. Until then
/// the film is in memory: ffmpeg does not report every disk that is full.
class Video {
 public:
  /// A film of frames of this size; the first one alone for .png. `program` is found as a shell
  /// finds it. Throws ConfigError for a name that is none of a film and without the program.
  Video(const std::filesystem::path& path, int width, int height, double fps,
        const std::string& program = "ffmpeg");
  ~Video();
  Video(const Video&) = delete;
  Video& operator=(const Video&) = delete;

  /// Throws Error with what ffmpeg said when it has ended before its time.
  void Write(const Image& frame);
  void Finish();

 private:
  void Wait();                    // for the end of the program
  [[noreturn]] void Fail();       // with its last words
  std::string LastWords() const;  // of its standard error

  std::filesystem::path path_;
  int width_, height_;
  int log_ = -1, film_ = -1;  // memory: what ffmpeg says, what it makes
  int pipe_ = -1;
  pid_t child_ = -1;
  int status_ = 0;
};

/// Images of one size side by side.
Image Strip(const std::vector<Image>& images);

}  // namespace o2v
