#include "render/video.h"

#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/check.h"
#include "base/files.h"

extern char** environ;

namespace o2v {
namespace {

constexpr int kFilm = 3;  // descriptor of the film in the child

/// What ffmpeg is told of the output.
std::vector<std::string> Coding(const std::filesystem::path& path) {
  const std::string ending = path.extension().string();
  if (ending == ".mp4") {  // H.264 as every browser shows it
    return {"-c:v", "libx264",   "-pix_fmt",   "yuv420p", "-crf",
            "20",   "-movflags", "+faststart", "-f",      "mp4"};
  }
  if (ending == ".gif") {  // a palette a frame: one for all would need all frames in memory
    return {"-vf", "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1", "-f",
            "gif"};
  }
  if (ending == ".png") return {"-frames:v", "1", "-c:v", "png", "-f", "image2pipe"};
  throw ConfigError(Concat(path.string(), ": the name of a film ends in .mp4, .gif or .png"));
}

}  // namespace

void RequireVideoName(const std::filesystem::path& path) { Coding(path); }

Video::Video(const std::filesystem::path& path, int width, int height, double fps,
             const std::string& program)
    : path_(path), width_(width), height_(height) {
  std::vector<std::string> words = {program,    "-v",
                                    "error",    "-y",
                                    "-f",       "rawvideo",
                                    "-pix_fmt", "rgb24",
                                    "-s",       Concat(width, "x", height),
                                    "-r",       std::to_string(fps),
                                    "-i",       "pipe:0"};
  for (const std::string& word : Coding(path)) words.push_back(word);
  words.push_back(Concat("file:/proc/self/fd/", kFilm));
  RequireWritable(path);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  log_ = ::memfd_create("log of ffmpeg", MFD_CLOEXEC);
  film_ = ::memfd_create("film", MFD_CLOEXEC);
  Check(log_ >= 0 && film_ >= 0, "film: no memory: ", std::strerror(errno));
  // A socket, not a pipe: writing to a program that has ended is an error there, no signal.
  int ends[2];
  Check(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0,
        "film: no pipe: ", std::strerror(errno));
  pipe_ = ends[0];
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawn_file_actions_adddup2(&files, ends[1], STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&files, log_, STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&files, log_, STDERR_FILENO);
  ::posix_spawn_file_actions_adddup2(&files, film_, kFilm);
  const int error =
      ::posix_spawnp(&child_, program.c_str(), &files, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&files);
  ::close(ends[1]);
  if (error != 0) {
    child_ = -1;
    ::close(std::exchange(pipe_, -1));
    ::close(log_);
    ::close(film_);
    throw ConfigError(Concat(program, ": cannot be run, which writes films: ", std::strerror(error),
                             "; `make deps FILM=1` installs it"));
  }
}

Video::~Video() {
  if (pipe_ >= 0) ::close(pipe_);
  if (child_ >= 0) {
    ::kill(child_, SIGKILL);
    Wait();
  }
  ::close(log_);
  ::close(film_);
}

void Video::Write(const Image& frame) {
  Check(frame.width == width_ && frame.height == height_, path_.string(), ": a frame of ",
        frame.width, "x", frame.height, ", not ", width_, "x", height_);
  const unsigned char* from = frame.rgb.data();
  for (std::size_t left = frame.rgb.size(); left > 0;) {
    const ssize_t sent = ::send(pipe_, from, left, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) Fail();
    from += sent;
    left -= std::size_t(sent);
  }
}

void Video::Finish() {
  ::close(std::exchange(pipe_, -1));
  Wait();
  if (!WIFEXITED(status_) || WEXITSTATUS(status_) != 0) Fail();
  const std::string film = ReadFile(Concat("/proc/self/fd/", film_));
  if (film.empty()) Fail();
  WriteFileAtomically(path_, film);
}

void Video::Wait() {
  while (::waitpid(child_, &status_, 0) < 0 && errno == EINTR) {
  }
  child_ = -1;
}

void Video::Fail() {
  if (child_ >= 0) Wait();
  const std::string words = LastWords();
  throw Error(Concat(path_.string(), ": ffmpeg ended early",
                     WIFSIGNALED(status_) ? Concat(", by signal ", WTERMSIG(status_)) : "",
                     words.empty() ? "" : ": " + words));
}

std::string Video::LastWords() const {
  char text[2000];
  const ssize_t n = ::pread(log_, text, sizeof text, 0);
  std::string words(text, std::size_t(std::max<ssize_t>(n, 0)));
  std::replace(words.begin(), words.end(), '\n', ' ');
  while (words.ends_with(' ')) words.pop_back();
  return words;
}

Image Strip(const std::vector<Image>& images) {
  Image strip;
  for (const Image& image : images) strip.width += image.width;
  strip.height = images.at(0).height;
  for (int y = 0; y < strip.height; ++y) {
    for (const Image& image : images) {
      const auto begin = image.rgb.begin() + std::ptrdiff_t{3} * image.width * y;
      strip.rgb.insert(strip.rgb.end(), begin, begin + std::ptrdiff_t{3} * image.width);
    }
  }
  return strip;
}

}  // namespace o2v
