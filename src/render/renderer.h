#pragma once
// Pictures of a task, drawn off screen by MuJoCo on OSMesa, the software renderer of Mesa. Its
// library is loaded when a renderer is made: nothing else needs it.

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "env/env.h"

namespace o2v {

/// RGB, 8 bits each; rows from the top.
struct Image {
  int width = 0, height = 0;
  std::vector<unsigned char> rgb;  // 3 * width * height

  std::array<int, 3> At(int x, int y) const {
    const std::size_t i = 3 * (std::size_t(y) * std::size_t(width) + std::size_t(x));
    return {rgb[i], rgb[i + 1], rgb[i + 2]};
  }
};

/// What stands on a picture.
struct Captions {
  std::string names, values;  // lines at the top left
  std::vector<int> options;   // of the episode's steps so far, the last one active
  int time_limit = 0;         // [steps] that the time line is long
};

/// RGB of option o: colours of Okabe and Ito, which the colour-blind tell apart.
std::array<int, 3> OptionColor(int o);

/// Heights [pixels] of what is drawn under the picture, of an image this high: the time line at the
/// very end, the bar of the active option above it.
struct Bands {
  int bar, time_line;
};
Bands BandsOf(int height);

/// Draws one task. One at a time is alive in a process: it owns the current OpenGL context.
class Renderer {
 public:
  /// Throws ConfigError without OSMesa, for a task that MuJoCo does not simulate, and for a size
  /// that cannot be drawn.
  Renderer(const Env& env, int width, int height);
  ~Renderer();

  /// The task as it is now, with captions. It reads positions and changes nothing.
  void Draw(const Captions& captions, Image& image);
  /// Seconds of an environment step.
  double StepSeconds() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace o2v
