// list: what the program knows: tasks, methods, switches.

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "algo/algorithm.h"
#include "algo/switches.h"
#include "base/check.h"
#include "cli/commands.h"
#include "env/env.h"
#include "env/pairs.h"
#include "report/align.h"
#include "run/config.h"

namespace o2v {
namespace {

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

// ---- The same for other programs

using Json = nlohmann::ordered_json;

Json TasksJson() {
  Json tasks = Json::array();
  for (const EnvEntry& entry : EnvRegistry()) {
    const EnvSpec spec = MakeEnv(entry.id, {})->Spec();
    tasks.push_back({{"id", spec.id}, {"S", spec.S}, {"A", spec.A}, {"limit", spec.time_limit}});
  }
  return tasks;
}

Json PairsJson() {
  Json pairs = Json::array();
  for (const TaskPair& pair : PairRegistry()) {
    pairs.push_back({{"name", pair.name}, {"first", pair.first}, {"second", pair.second}});
  }
  return pairs;
}

/// Whether a method has options, and embeddings of them, it says itself.
Json AlgorithmsJson() {
  Json algorithms = Json::array();
  const std::string task = EnvRegistry().front().id;
  const EnvSpec spec = MakeEnv(task, {})->Spec();
  for (const AlgorithmEntry& entry : AlgorithmRegistry()) {
    RunRequest request;
    request.task = task;
    request.algorithm = entry.id;
    const auto method = MakeRunAlgorithm(ResolveRun(request), spec, /*draw_weights=*/false);
    algorithms.push_back({{"id", entry.id},
                          {"name", entry.name},
                          {"revision", entry.revision},
                          {"options", method->NumOptions() > 1},
                          {"embedding", method->Embedding() != nullptr}});
  }
  return algorithms;
}

Json SwitchesJson() {
  Json switches = Json::array();
  for (const SwitchInfo& info : SwitchRegistry()) {
    Json methods = info.methods;
    if (info.methods.empty()) {
      for (const AlgorithmEntry& entry : AlgorithmRegistry()) methods.push_back(entry.id);
    }
    switches.push_back({{"id", info.name},
                        {"paper", SwitchValue(SwitchesFor(Fidelity::kPaper), info)},
                        {"released", SwitchValue(SwitchesFor(Fidelity::kReleased), info)},
                        {"takes", SwitchRange(info)},
                        {"methods", methods},
                        {"effect", info.effect}});
  }
  return switches;
}

}  // namespace

void AddList(CLI::App& app) {
  CLI::App* list = app.add_subcommand("list", "list tasks, algorithms or switches");
  list->require_subcommand(0, 1);
  auto json = std::make_shared<bool>(false);
  list->add_flag("--json", *json, "for other programs; all lists where none is named");
  CLI::App* tasks =
      list->add_subcommand("tasks", "task ids with sizes and time limits; pairs of tasks");
  CLI::App* algorithms = list->add_subcommand("algorithms", "method ids");
  CLI::App* switches =
      list->add_subcommand("switches", "every difference between `paper` and `released`");
  for (CLI::App* one : {tasks, algorithms, switches}) one->fallthrough();
  list->footer("Examples:\n  option2vec list switches\n  option2vec list --json");
  list->callback([=] {
    const bool all = list->get_subcommands().empty();
    if (all && !*json) throw ConfigError("list: name a list: tasks, algorithms or switches");
    if (*json) {
      Json lists;
      if (all || *tasks) lists["tasks"] = TasksJson(), lists["pairs"] = PairsJson();
      if (all || *algorithms) lists["algorithms"] = AlgorithmsJson();
      if (all || *switches) lists["switches"] = SwitchesJson();
      std::cout << lists.dump(1) << "\n";
      return;
    }
    if (*tasks) ListTasks();
    if (*algorithms) ListAlgorithms();
    if (*switches) ListSwitches();
  });
}

}  // namespace o2v
