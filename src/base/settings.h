#pragma once
// The numbers that a method reads, with their origin.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/check.h"

namespace o2v {

/// Flat table key -> number. A reader asks for what it needs; a key that nobody asked for
/// is an error of the configuration, found by `Unused` before the first step.
class Settings {
 public:
  /// Sets or replaces a number. `origin` is where it came from ("file:line"), used in messages.
  void Set(const std::string& key, double value, std::string origin);

  bool Has(std::string_view key) const;
  /// The number under `key`. Throws ConfigError when it is missing.
  double Real(std::string_view key) const;
  /// The same, a whole number in [low, 2^31). Throws ConfigError otherwise.
  int Int(std::string_view key, int low = 0) const;

  /// Keys that were never read.
  std::vector<std::string> Unused() const;
  /// Where the key was set; empty when it was not.
  std::string Origin(std::string_view key) const;

  /// All (key, value), by key.
  std::vector<std::pair<std::string, double>> Items() const;

 private:
  struct Entry {
    double value;
    std::string origin;
    mutable bool used = false;
  };
  std::map<std::string, Entry, std::less<>> entries_;
};

}  // namespace o2v
