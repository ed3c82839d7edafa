#include "cli/options.h"

#include <csignal>
#include <iostream>

namespace o2v {
namespace {

// Set by SIGINT and SIGTERM: a handler can reach nothing else.
volatile std::sig_atomic_t stop_signal = 0;

}  // namespace

CLI::Option* AddReal(CLI::App& app, const std::string& name, double& value, double low,
                     const char* kind, const std::string& help) {
  const auto read = [low](const std::string& text) {
    const auto x = ReadReal(text);
    return x && *x >= low ? x : std::nullopt;
  };
  return AddNumber(app, name, value, read, Concat("a ", kind, " finite number"), help);
}

void RunOptions::Add(CLI::App& app) {
  app.add_option("--task", request.task,
                 "task id or pair (see `list tasks`); A,B: first A, then B");
  app.add_option("--algo", request.algorithm, "method id (see `list algorithms`)");
  app.add_option("--fidelity", request.fidelity, "paper (default) or released");
  app.add_option("--set", request.set,
                 "key=value: a switch, or a number of the method or run; repeatable")
      ->allow_extra_args(false);
}

void NoteSignals() {
  std::signal(SIGINT, [](int signal) { stop_signal = signal; });
  std::signal(SIGTERM, [](int signal) { stop_signal = signal; });
}

bool Signalled() { return stop_signal != 0; }

void NameRefused(const std::vector<std::string>& refused) {
  for (const std::string& reason : refused) std::cerr << reason << "\n";
  if (!refused.empty()) std::cerr << refused.size() << " records refused\n";
}

}  // namespace o2v
