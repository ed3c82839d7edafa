// film: a policy in motion, with its options.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/decimal.h"
#include "cli/commands.h"
#include "cli/options.h"
#include "cli/policy_file.h"
#include "render/renderer.h"
#include "render/video.h"
#include "run/config.h"
#include "run/evaluate.h"

namespace o2v {
namespace {

/// "640x480".
std::pair<int, int> ReadSize(const std::string& text) {
  const std::size_t x = text.find('x');
  if (x != std::string::npos) {
    const auto width = ReadWhole(text.substr(0, x)), height = ReadWhole(text.substr(x + 1));
    if (width && height && *width <= kMaxInt && *height <= kMaxInt) {
      return {int(*width), int(*height)};
    }
  }
  throw ConfigError(Concat("--size: '", text, "' is not WIDTHxHEIGHT"));
}

/// How far an episode has come.
Captions Describe(const EvalStep& step, const EnvSpec& spec, double ret) {
  char values[120];
  std::snprintf(values, sizeof values, "%d\n%d\n%.1f", step.episode, step.t + 1, ret);
  return {"episode\nstep\nreturn", values, {}, spec.time_limit};
}

constexpr int kStrip = 6;  // frames of a .png

}  // namespace

void AddFilm(CLI::App& app) {
  struct Options : RunOptions {
    std::string checkpoint, action = "sample", size = "640x480";
    std::filesystem::path out;
    int episodes = 1, fps = 30;
    std::uint64_t seed = 0;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* film = app.add_subcommand("film", "a film of a policy, with its options");
  film->add_option("--checkpoint", opt->checkpoint, "last.ckpt of a run, or a policy")->required();
  opt->Add(*film);
  AddWhole(*film, "--episodes", opt->episodes, 1, kMaxInt, "whole episodes")->default_str("1");
  film->add_option("--action", opt->action, "sample: from the Gaussian; mean: its mean")
      ->check(CLI::IsMember({"sample", "mean"}))
      ->capture_default_str();
  AddWhole(*film, "--seed", opt->seed, 0, kMaxWhole, "of the episodes")->default_str("0");
  film->add_option("--size", opt->size, "of a frame, pixels")->capture_default_str();
  AddWhole(*film, "--fps", opt->fps, 1, 1000, "frames a second, at most")->default_str("30");
  film->add_option("--out", opt->out, "x.mp4 or x.gif; x.png: a strip of six frames")->required();
  film->footer(
      "In the time of the simulator. The bar shows the active option, the line below it those of\n"
      "the episode so far. Needs OSMesa and ffmpeg: `make deps FILM=1`.\n"
      "Example:\n"
      "  option2vec film --checkpoint results/policies/HalfCheetah-v2-released.safetensors "
      "--out cheetah.mp4");
  film->callback([opt] {
    RequireVideoName(opt->out);
    const auto [width, height] = ReadSize(opt->size);
    LoadedPolicy policy = LoadPolicyFile(opt->checkpoint, opt->request);
    const EnvSpec& spec = policy.env->Spec();
    const bool strip = opt->out.extension() == ".png";
    NoteSignals();
    const auto run = [&](const StepHook& visit) {
      const auto episodes =
          Evaluate(*policy.algorithm, policy.normalizer, *policy.env, opt->episodes,
                   opt->action == "sample", opt->seed, visit, Signalled);
      if (Signalled()) throw Error(opt->out.string() + ": stopped by a signal");
      return episodes;
    };
    Renderer renderer(*policy.env, width, height);
    const double step_seconds = renderer.StepSeconds();
    const int stride = std::max(1, int(std::ceil(1 / (step_seconds * opt->fps) - 1e-9)));
    Video video(opt->out, strip ? kStrip * width : width, height, 1 / (step_seconds * stride));

    int steps = 0;  // of all episodes
    if (strip) run([&](const EvalStep&) { ++steps; });
    std::vector<Image> images;
    Captions captions;
    std::vector<int> options;
    double ret = 0;
    int n = 0, frames = 0;
    Image image;
    const auto episodes = run([&](const EvalStep& step) {
      if (step.t == 0) options.clear(), ret = 0;
      options.push_back(step.o);
      ret += step.reward;
      const bool wanted =
          strip ? n == int(images.size()) * (steps - 1) / (kStrip - 1) : step.t % stride == 0;
      ++n;
      if (!wanted) return;
      captions = Describe(step, spec, ret);
      if (policy.algorithm->NumOptions() > 1) captions.options = options;
      renderer.Draw(captions, image);
      ++frames;
      strip ? images.push_back(image) : video.Write(image);
    });
    if (strip) {
      images.resize(kStrip, images.back());  // of an episode that is shorter
      video.Write(Strip(images));
    }
    video.Finish();
    std::cout << "episode,return,length\n";
    for (std::size_t e = 0; e < episodes.size(); ++e) {
      std::cout << e << "," << episodes[e].ret << "," << episodes[e].length << "\n";
    }
    std::cout << "# " << opt->out.string() << ": " << frames << " frames\n";
  });
}

}  // namespace o2v
