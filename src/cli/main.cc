// The program: subcommands, exit codes. 0 success, 1 Error, 2 ConfigError or wrong usage, 3
// DivergedError.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "base/decimal.h"
#include "base/files.h"
#include "base/printable.h"
#include "env/pairs.h"
#include "env/replay.h"
#include "harness/align.h"
#include "harness/checkpoint.h"
#include "harness/config.h"
#include "harness/evaluate.h"
#include "harness/interpret.h"
#include "harness/jobs.h"
#include "harness/manifest.h"
#include "harness/param_table.h"
#include "harness/record.h"
#include "harness/stats.h"
#include "harness/summary.h"
#include "harness/tensorboard.h"
#include "harness/trainer.h"
#include "nn/isa.h"
#include "render/renderer.h"
#include "render/video.h"

namespace o2v {
namespace {

// ---- numbers; by the rules of --set, as CLI11's own would be octal or hexadecimal at times

/// An option whose text `read` turns into a number. `what` it must be is for messages.
template <typename Value, typename Read>
CLI::Option* AddNumber(CLI::App& app, const std::string& name, Value& value, const Read& read,
                       const std::string& what, const std::string& help) {
  const auto take = [&value, read, name, what](const std::string& text) {
    const auto x = read(text);
    if (!x) throw ConfigError(Concat(name, ": '", text, "' is not ", what));
    value = Value(*x);
  };
  return app.add_option_function<std::string>(name, take, help)->type_name("NUMBER");
}

/// A whole number in [low, high].
template <typename Value>
CLI::Option* AddWhole(CLI::App& app, const std::string& name, Value& value, std::int64_t low,
                      std::int64_t high, const std::string& help) {
  const auto read = [low, high](const std::string& text) {
    const auto x = ReadWhole(text);
    return x && *x >= low && *x <= high ? x : std::nullopt;
  };
  return AddNumber(app, name, value, read, Concat("a whole number in [", low, ", ", high, "]"),
                   help);
}

/// A finite number from `low` on.
CLI::Option* AddReal(CLI::App& app, const std::string& name, double& value, double low,
                     const char* kind, const std::string& help) {
  const auto read = [low](const std::string& text) {
    const auto x = ReadReal(text);
    return x && *x >= low ? x : std::nullopt;
  };
  return AddNumber(app, name, value, read, Concat("a ", kind, " finite number"), help);
}

constexpr int kMaxInt = std::numeric_limits<int>::max();
constexpr std::int64_t kMaxWhole = std::numeric_limits<std::int64_t>::max();

// Set by SIGINT and SIGTERM: a handler can reach nothing else.
volatile std::sig_atomic_t stop_signal = 0;

/// Options that name a task and a method, of `train`, `eval`, `forward` and `interpret`.
struct RunOptions {
  RunRequest request;
  std::optional<std::string> config;

  void Add(CLI::App& app) {
    app.add_option("--task", request.task,
                   "task id or pair (see `list tasks`); A,B: first A, then B");
    app.add_option("--algo", request.algorithm, "method id (see `list algorithms`)");
    app.add_option("--fidelity", request.fidelity, "paper (default) or released");
    app.add_option("--set", request.set,
                   "key=value: a switch, or a number of the method or run; repeatable")
        ->allow_extra_args(false);
  }
};

// ---- list

void ListTasks() {
  std::vector<std::vector<std::string>> lines = {{"task", "S", "A", "time limit [steps]"}};
  for (const EnvEntry& entry : EnvRegistry()) {
    const EnvSpec spec = MakeEnv(entry.id, {})->Spec();
    lines.push_back(
        {spec.id, std::to_string(spec.S), std::to_string(spec.A), std::to_string(spec.time_limit)});
  }
  std::cout << AlignColumns(lines);
  lines = {{"pair", "first", "second"}};
  for (const TaskPair& pair : PairRegistry()) lines.push_back({pair.name, pair.first, pair.second});
  std::cout << "\n" << AlignColumns(lines);
}

void ListAlgorithms() {
  std::vector<std::vector<std::string>> lines = {{"algorithm", "name"}};
  for (const AlgorithmEntry& entry : AlgorithmRegistry()) lines.push_back({entry.id, entry.name});
  std::cout << AlignColumns(lines);
}

void ListSwitches() {
  std::vector<std::vector<std::string>> lines = {
      {"switch", "paper", "released", "takes", "methods", "effect"}};
  const Switches paper = SwitchesFor(Fidelity::kPaper);
  const Switches released = SwitchesFor(Fidelity::kReleased);
  for (const SwitchInfo& info : SwitchRegistry()) {
    std::string methods;
    for (const std::string& method : info.methods) methods += (methods.empty() ? "" : ",") + method;
    lines.push_back({info.name, SwitchValue(paper, info), SwitchValue(released, info),
                     SwitchRange(info), methods.empty() ? "all" : methods, info.effect});
  }
  std::cout << AlignColumns(lines);
}

void AddList(CLI::App& app) {
  CLI::App* list = app.add_subcommand("list", "list tasks, algorithms or switches");
  list->require_subcommand(1);
  list->add_subcommand("tasks", "task ids with sizes and time limits; pairs of tasks")
      ->callback(ListTasks);
  list->add_subcommand("algorithms", "method ids")->callback(ListAlgorithms);
  list->add_subcommand("switches", "every difference between `paper` and `released`")
      ->callback(ListSwitches);
  list->footer("Example:\n  option2vec list switches");
}

// ---- train

void AddTrain(CLI::App& app) {
  struct Options : RunOptions {
    std::string out;
    bool resume = false;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* train = app.add_subcommand("train", "train one run into one folder");
  opt->Add(*train);
  AddWhole(*train, "--seed", opt->request.seed, 0, kMaxWhole,
           "seed of all random streams (default 0)");
  AddWhole(*train, "--steps", opt->request.steps, 1, kMaxWhole,
           "environment steps, summed over workers");
  train->add_option("--out", opt->out, "folder of the run")->required();
  train->add_option("--config", opt->config,
                    "a .toml file, or the name of a built-in one; the other options win over it");
  train->add_flag("--resume", opt->resume, "continue an unfinished run, or start a new one");
  train->footer(
      "Examples:\n"
      "  option2vec train --task HalfCheetah-v2 --algo option2vec --seed 1 --out runs/a\n"
      "  option2vec train --task Hopper-v2 --algo ppo --fidelity released --set hidden=64 "
      "--steps 200000 --out runs/b\n"
      "  option2vec train --config runs/a/config.toml --out runs/a --resume");
  train->callback([opt] {
    if (opt->config) opt->request.config = OpenConfig(*opt->config);
    const RunConfig config = ResolveRun(opt->request);
    std::signal(SIGINT, [](int signal) { stop_signal = signal; });
    std::signal(SIGTERM, [](int signal) { stop_signal = signal; });
    RunHooks hooks;
    hooks.stop = [] { return stop_signal != 0; };
    const bool terminal = ::isatty(STDERR_FILENO) == 1;
    if (Train(config, opt->out, opt->resume, std::cerr, terminal, hooks) == RunStatus::kStopped) {
      throw Error(opt->out + ": stopped by a signal; use --resume to continue");
    }
  });
}

// ---- eval, forward, interpret

/// A checkpoint's policy on its task.
struct LoadedPolicy {
  RunConfig config;
  std::unique_ptr<Env> env;
  std::unique_ptr<Algorithm> algorithm;
  Normalizer normalizer;
};

/// `request` completes, or repeats, what the file says of itself.
LoadedPolicy LoadPolicyFile(const std::string& checkpoint, RunRequest request) {
  const Metadata metadata = ReadMetadata(checkpoint);
  if (const auto config = metadata.find("config"); config != metadata.end()) {
    const RunConfig own = ParseRunConfig(config->second, checkpoint);
    auto agree = [&](const std::optional<std::string>& given, const std::string& is) {
      if (given && *given != is) {
        throw ConfigError(Concat(checkpoint, ": trained with '", is, "', not '", *given, "'"));
      }
    };
    agree(request.algorithm, own.algorithm);
    agree(request.fidelity, ToString(own.fidelity));
    request.config = ConfigText{checkpoint, config->second};
  }
  const std::optional<std::string> task = request.task;
  if (request.config) request.task.reset();  // the file's own; --task says where to act
  const RunConfig config = ResolveRun(request);
  const EnvOptions options{.contact_forces = config.switches.contact_forces};
  std::unique_ptr<Env> env = MakeEnv(SplitTasks(task.value_or(config.task)).back(), options);
  const EnvSpec spec = env->Spec();
  LoadedPolicy policy{config, std::move(env), MakeRunAlgorithm(config, spec), Normalizer(spec.S)};
  LoadPolicy(checkpoint, *policy.algorithm, policy.normalizer);
  return policy;
}

void AddEval(CLI::App& app) {
  struct Options : RunOptions {
    std::string checkpoint, action = "sample";
    std::optional<std::string> trajectory;
    int episodes = 10;
    std::uint64_t seed = 0;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* eval =
      app.add_subcommand("eval", "run episodes with a trained policy and print their returns");
  eval->add_option("--checkpoint", opt->checkpoint,
                   "last.ckpt of a run, or a safetensors file from elsewhere")
      ->required();
  opt->Add(*eval);
  AddWhole(*eval, "--episodes", opt->episodes, 1, kMaxInt, "number of whole episodes")
      ->default_str("10");
  eval->add_option("--action", opt->action, "sample the Gaussian, or take its mean")
      ->check(CLI::IsMember({"sample", "mean"}))
      ->capture_default_str();
  AddWhole(*eval, "--seed", opt->seed, 0, kMaxWhole, "seed of the episodes")->default_str("0");
  eval->add_option("--trajectory", opt->trajectory,
                   "CSV of all steps: episode, step, o, P0.., a0.., reward, obs0..");
  eval->footer(
      "--task, --algo, --fidelity and --set are needed only when the file does not name them.\n"
      "After a transfer run, --task chooses one of its tasks (default: the last one).\n"
      "Options are always sampled.\n"
      "Examples:\n"
      "  option2vec eval --checkpoint runs/a/last.ckpt --task HalfCheetah-v2 --action mean\n"
      "  option2vec eval --checkpoint foreign.safetensors --task Hopper-v2 --algo ppo "
      "--fidelity released");
  eval->callback([opt] {
    LoadedPolicy policy = LoadPolicyFile(opt->checkpoint, opt->request);
    CsvTable trajectory = NewTrajectory(policy.env->Spec(), policy.algorithm->NumOptions());
    StepHook visit;
    if (opt->trajectory) {
      RequireWritable(*opt->trajectory);
      visit = [&trajectory](const EvalStep& step) { Append(step, trajectory); };
    }
    const auto episodes = Evaluate(*policy.algorithm, policy.normalizer, *policy.env, opt->episodes,
                                   opt->action == "sample", opt->seed, visit);
    if (opt->trajectory) WriteFileAtomically(*opt->trajectory, CsvText(trajectory));
    std::vector<double> returns;
    std::cout << "episode,return,length\n";
    for (const EvalEpisode& episode : episodes) {
      std::cout << returns.size() << "," << episode.ret << "," << episode.length << "\n";
      returns.push_back(episode.ret);
    }
    std::cout << "# mean " << Mean(returns) << " +- " << Std(returns) << " (std, n "
              << returns.size() << ")\n";
  });
}

void AddForward(CLI::App& app) {
  struct Options : RunOptions {
    std::string checkpoint, input, output;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* forward =
      app.add_subcommand("forward", "compute the networks' outputs at given inputs");
  forward
      ->add_option("--checkpoint", opt->checkpoint,
                   "last.ckpt of a run, or a safetensors file from elsewhere")
      ->required();
  opt->Add(*forward);
  forward->add_option("--input", opt->input, "CSV: s0.. (normalised state), o_prev, init, o")
      ->required();
  forward->add_option("--out", opt->output, "CSV: P0.., mu0.., sigma0.., q0..")->required();
  forward->footer(
      "Options count from 0. Action net and critic get option o. Dropout is off.\n"
      "Example:\n"
      "  option2vec forward --checkpoint runs/a/last.ckpt --input states.csv --out outputs.csv");
  forward->callback([opt] {
    LoadedPolicy policy = LoadPolicyFile(opt->checkpoint, opt->request);
    Forward(*policy.algorithm, policy.env->Spec(), opt->input, opt->output);
  });
}

void AddInterpret(CLI::App& app) {
  struct Options : RunOptions {
    std::filesystem::path run, out;
    int episodes = 10;
    double delta = kDelta;
    std::uint64_t seed = 0;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* interpret =
      app.add_subcommand("interpret", "measure what each dimension of Option2Vec's embedding does");
  interpret->add_option("run", opt->run, "folder of a run, or a checkpoint file")->required();
  opt->Add(*interpret);
  AddWhole(*interpret, "--episodes", opt->episodes, 1, kMaxInt, "number of whole episodes")
      ->default_str("10");
  AddReal(*interpret, "--delta", opt->delta, std::numeric_limits<double>::min(), "positive",
          "change of a dimension")
      ->default_str(Decimal(kDelta));
  AddWhole(*interpret, "--seed", opt->seed, 0, kMaxWhole, "seed of the episodes")->default_str("0");
  interpret->add_option(
      "--out", opt->out,
      "CSV (default results/interpret/<fidelity>/<task>/option2vec/seed-NNN.csv);\n"
      "a .json file beside it says how it was made. Existing files are replaced only\n"
      "if `interpret` wrote them");
  interpret->footer(
      "Writes one row per dimension d: W_o(d, k); the mean of d mu_a / d o_hat_d over visited "
      "states;\n"
      "the mean change of mu_a when o_hat_d grows by delta. o_hat is the executed option's "
      "embedding.\n"
      "After a transfer run, --task chooses one of its tasks (default: the last one). The "
      "networks\n"
      "are those at the end of the run.\n"
      "Example:\n  option2vec interpret runs/a --episodes 20 --out a.csv");
  interpret->callback([opt] {
    const std::filesystem::path file = FindCheckpoint(opt->run);
    LoadedPolicy policy = LoadPolicyFile(file.string(), opt->request);
    if (!policy.algorithm->Embedding()) {
      throw ConfigError(Concat(file.string(), ": trained by ", policy.config.algorithm,
                               ", whose options have no embedding"));
    }
    const Metadata metadata = ReadMetadata(file);
    if (opt->out.empty() && !metadata.contains("config")) {
      throw ConfigError(file.string() + ": does not name its run; give --out");
    }
    const std::string& task = policy.env->Spec().id;
    const std::filesystem::path out =
        opt->out.empty() ? InterpretationPath(policy.config, task) : opt->out;
    if (out.has_parent_path()) std::filesystem::create_directories(out.parent_path());
    RequireInterpretationPlace(out);
    const Interpretation found = Interpret(*policy.algorithm, policy.normalizer, *policy.env,
                                           opt->episodes, opt->delta, opt->seed);
    if (const auto json = BesideInterpretation(out)) {
      WriteFileAtomically(*json,
                          InterpretationJson(found, metadata, task, opt->episodes, opt->seed));
    }
    WriteFileAtomically(out, InterpretationCsv(found));
    std::cout << out.string() << ": " << found.W_o.rows() << " dimensions, " << found.states
              << " states of " << opt->episodes << " episodes on " << task << "\n";
  });
}

// ---- export

void AddExport(CLI::App& app) {
  struct Options : RunOptions {
    std::optional<std::string> policy, tensorboard;
    std::filesystem::path out;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("export", "a run or its policy for other programs");
  CLI::App* what = command->add_option_group("what")->require_option(1);
  what->add_option("--policy", opt->policy,
                   "folder of a run, or a checkpoint: parameters and normaliser alone into --out");
  what->add_option("--tensorboard", opt->tensorboard,
                   "folder of a run: its curves as an event file in the folder --out");
  opt->Add(*command);
  command->add_option("--out", opt->out, "file of the policy; folder of the event file")
      ->required();
  command->footer(
      "Task, method, fidelity and --set are for policies whose file does not say them.\n"
      "Examples:\n"
      "  option2vec export --policy runs/a --out a.safetensors\n"
      "  option2vec export --tensorboard runs/a --out tensorboard/a");
  command->callback([opt] {
    if (opt->policy) {
      RequireWritable(opt->out);
      const std::filesystem::path file = FindCheckpoint(*opt->policy);
      LoadedPolicy policy = LoadPolicyFile(file.string(), opt->request);
      Metadata metadata = ReadMetadata(file);
      if (metadata.empty()) metadata = {{"config", ToToml(policy.config)}};
      SavePolicy(opt->out, metadata, *policy.algorithm, policy.normalizer);
    } else {
      const std::string events = EventFile(FolderPath(*opt->tensorboard));
      std::filesystem::create_directories(opt->out);
      WriteFileAtomically(opt->out / "events.out.tfevents.option2vec", events);
    }
  });
}

// ---- film

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
    std::signal(SIGINT, [](int signal) { stop_signal = signal; });
    std::signal(SIGTERM, [](int signal) { stop_signal = signal; });
    const auto run = [&](const StepHook& visit) {
      const auto episodes =
          Evaluate(*policy.algorithm, policy.normalizer, *policy.env, opt->episodes,
                   opt->action == "sample", opt->seed, visit, [] { return stop_signal != 0; });
      if (stop_signal != 0) throw Error(opt->out.string() + ": stopped by a signal");
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

// ---- params

void AddParams(CLI::App& app) {
  auto csv = std::make_shared<bool>(false);
  CLI::App* params = app.add_subcommand("params", "count parameters by task, method and width");
  params->add_flag("--csv", *csv, "print CSV");
  params->footer("Example:\n  option2vec params --csv");
  params->callback([csv] {
    const auto rows = ParamTable();
    std::cout << (*csv ? ParamCsv(rows) : ParamText(rows));
  });
}

// ---- replay

void AddReplay(CLI::App& app, int& exit_code) {
  struct Options {
    std::string task, trajectory, out;
    double tolerance = 1e-9;  // spec E.6
  };
  auto opt = std::make_shared<Options>();
  CLI::App* replay =
      app.add_subcommand("replay", "compare a recorded trajectory with our simulation");
  replay->add_option("--task", opt->task, "task id")->required();
  replay
      ->add_option("--trajectory", opt->trajectory,
                   "CSV: step, ctrl0.., qpos0.., qvel0..; optionally reward, terminated, obs0..,\n"
                   "target0..")
      ->required();
  replay->add_option("--out", opt->out, "our trajectory, with the same columns");
  AddReal(*replay, "--tolerance", opt->tolerance, 0, "non-negative",
          "largest allowed |a - b| / max(1, |b|)")
      ->default_str(Decimal(opt->tolerance));
  replay->footer(
      "A row with step 0 sets the state. The exit code is 1 on FAIL.\n"
      "Example:\n  option2vec replay --task Hopper-v2 --trajectory hopper.csv --out ours.csv");
  replay->callback([opt, &exit_code] {
    const Deviation worst = ReplayFile(opt->task, opt->trajectory, opt->out);
    const bool pass = worst.value <= opt->tolerance;
    std::cout << (pass ? "PASS" : "FAIL") << ": largest deviation " << worst.value;
    if (!worst.column.empty()) {
      std::cout << " in column " << worst.column << ", row " << worst.row;
    }
    std::cout << " (tolerance " << opt->tolerance << ")\n";
    if (!pass) exit_code = 1;
  });
}

// ---- record, jobs, summary

void AddRecord(CLI::App& app) {
  auto runs = std::make_shared<std::vector<std::string>>();
  CLI::App* record = app.add_subcommand("record", "rewrite the records of finished runs");
  record->add_option("runs", *runs, "folders of runs")->required();
  record->footer(
      "`train` writes the record when a run ends. This command renews records of an older "
      "version.\n"
      "Example:\n  option2vec record results/quick/paper/*/ppo/seed-000");
  record->callback([runs] {
    for (const std::string& run : *runs) {
      const std::filesystem::path dir = FolderPath(run);
      const auto manifest = ReadManifest(dir);
      if (!manifest ||
          (manifest->status != RunStatus::kDone && manifest->status != RunStatus::kDiverged)) {
        throw ConfigError(run + ": not the folder of a finished run");
      }
      const std::string path = (dir / "config.toml").string(), config = ReadFile(path);
      RequireRecordPlace(dir, config, /*begun=*/true);
      WriteRecord(dir, ReadFile(dir / "manifest.json"), ParseRunConfig(config, path).steps);
    }
  });
}

/// Records that do not count, on standard error, and how many they are.
void NameRefused(const std::vector<std::string>& refused) {
  for (const std::string& reason : refused) std::cerr << reason << "\n";
  if (!refused.empty()) std::cerr << refused.size() << " records refused\n";
}

std::vector<std::string> RefusedOf(const std::vector<Job>& jobs) {
  std::vector<std::string> refused;
  for (const Job& job : jobs) {
    if (!job.refused.empty()) refused.push_back(job.refused);
  }
  return refused;
}

/// Options that name a grid of runs, of `jobs` and `progress`.
struct GridOptions {
  JobQuery query;
  std::optional<std::string> seeds;

  void Add(CLI::App& app) {
    app.add_option("experiments", query.configs,
                   "a .toml file, or a built-in suite: quick, single_task, ...")
        ->required();
    app.add_option("--tasks", query.tasks,
                   "A,B instead of the experiment's; with several experiments: the tasks to take")
        ->delimiter(',');
    app.add_option("--algos", query.algorithms, "methods instead of the experiment's")
        ->delimiter(',');
    app.add_option("--fidelity", query.fidelities, "fidelities instead of the experiment's")
        ->delimiter(',');
    app.add_option("--seeds", seeds, "seeds instead of the experiment's, such as 0-4,7");
    app.add_option("--results", query.results, "folder of all results")->capture_default_str();
  }
  std::vector<Job> List() {
    if (seeds) query.seeds = ParseSeeds(*seeds);
    return ListJobs(query);
  }
};

void AddJobs(CLI::App& app, const std::string& program) {
  auto opt = std::make_shared<GridOptions>();
  opt->query.program = program;
  CLI::App* jobs = app.add_subcommand("jobs", "list the runs of experiments, one command per line");
  opt->Add(*jobs);
  jobs->footer(
      "A command starts its run or continues it. Finished and diverged runs are left out.\n"
      "Those made by an older revision of the method are named on standard error.\n"
      "Example:\n  option2vec jobs quick --seeds 0-4 | xargs -P 2 -d '\\n' -n 1 sh -c");
  jobs->callback([opt] {
    const std::vector<Job> list = opt->List();
    for (const Job& job : list) {
      if (!job.refused.empty()) continue;
      if (!job.finished) {
        std::cout << job.command << "\n";
      } else if (job.old) {
        std::cerr << Printable(job.dir.string()) << ": made by an older revision of the method\n";
      }
    }
    NameRefused(RefusedOf(list));
  });
}

void AddProgress(CLI::App& app) {
  struct Options : GridOptions {
    int at_once = 1;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* progress = app.add_subcommand(
      "progress", "show how many runs of experiments are done and how long the rest takes");
  opt->Add(*progress);
  AddWhole(*progress, "--at-once", opt->at_once, 1, kMaxInt, "number of runs at a time")
      ->default_str("1");
  progress->footer(
      "The time left is estimated from finished runs of the same kind.\n"
      "Example:\n  option2vec progress single_task transfer --fidelity paper --at-once 2");
  progress->callback([opt] {
    const std::vector<Job> list = opt->List();
    std::cout << ToString(MeasureProgress(list), opt->at_once) << "\n";
    NameRefused(RefusedOf(list));
  });
}

void AddSummary(CLI::App& app) {
  auto folders = std::make_shared<std::vector<std::string>>();
  CLI::App* summary =
      app.add_subcommand("summary", "print an experiment's results beside the authors'");
  summary->add_option("experiment", *folders, "results/<experiment>")->required();
  summary->footer(
      "The table also goes into <experiment>/summary.csv.\n"
      "Example:\n  option2vec summary results/quick");
  summary->callback([folders] {
    for (const std::string& folder : *folders) {
      const auto [rows, refused] = Summarize(folder);
      NameRefused(refused);
      if (rows.empty()) throw ConfigError(folder + ": no record of a finished run");
      WriteFileAtomically(std::filesystem::path(folder) / "summary.csv", SummaryCsv(rows));
      std::cout << folder << "\n" << SummaryTable(rows) << "\n";
    }
  });
}

int Main(int argc, char** argv) {
  CLI::App app("Option2Vec and seven rivals on MuJoCo tasks: a reference reproduction.",
               "option2vec");
  app.require_subcommand(1);
  app.footer("`option2vec SUBCOMMAND --help` shows options and examples.");
  app.set_version_flag("--version", VersionText,
                       "commit, compiler, flags, versions, products, libmujoco");
  int exit_code = 0;
  AddList(app);
  AddTrain(app);
  AddEval(app);
  AddForward(app);
  AddInterpret(app);
  AddExport(app);
  AddFilm(app);
  AddParams(app);
  AddReplay(app, exit_code);
  AddRecord(app);
  AddJobs(app, argv[0]);
  AddProgress(app);
  AddSummary(app);
  const auto fail = [](const std::exception& e, int code) {
    std::cerr << "option2vec: " << Printable(e.what()) << "\n";
    return code;
  };
  // What a command prints is written in one go when it ends, so that a loss is seen.
  std::ostringstream text;
  std::streambuf* const own = std::cout.rdbuf(text.rdbuf());
  try {
    ChosenIsa();  // throws when O2V_ISA is wrong
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {  // --help
    exit_code = app.exit(e);
  } catch (const CLI::ParseError& e) {
    exit_code = fail(e, 2);
  } catch (const ConfigError& e) {
    exit_code = fail(e, 2);
  } catch (const DivergedError& e) {
    exit_code = fail(e, 3);
  } catch (const std::exception& e) {
    exit_code = fail(e, 1);
  }
  std::cout.rdbuf(own);
  try {
    WriteAll(STDOUT_FILENO, "standard output", text.str());
  } catch (const Error& e) {
    exit_code = fail(e, exit_code == 0 ? 1 : exit_code);
  }
  return exit_code;
}

}  // namespace
}  // namespace o2v

int main(int argc, char** argv) {
  o2v::OpenStandardStreams();
  return o2v::Main(argc, argv);
}
