#pragma once
// Options that several commands share.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "base/check.h"
#include "base/decimal.h"
#include "run/config.h"

namespace o2v {

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
                     const char* kind, const std::string& help);

inline constexpr int kMaxInt = std::numeric_limits<int>::max();
inline constexpr std::int64_t kMaxWhole = std::numeric_limits<std::int64_t>::max();

/// Options that name a task and a method: of `train`, and of commands that take a policy.
struct RunOptions {
  RunRequest request;
  std::optional<std::string> config;

  void Add(CLI::App& app);
};

/// From now on SIGINT and SIGTERM are noted instead of ending the program.
void NoteSignals();
/// Whether one has come.
bool Signalled();

/// Prints refused records and their number to standard error.
void NameRefused(const std::vector<std::string>& refused);

}  // namespace o2v
