#include "base/settings.h"

#include <cmath>
#include <limits>

namespace o2v {

void Settings::Set(const std::string& key, double value, std::string origin) {
  entries_[key] = Entry{value, std::move(origin)};
}

bool Settings::Has(std::string_view key) const { return entries_.contains(key); }

double Settings::Real(std::string_view key) const {
  const auto it = entries_.find(key);
  if (it == entries_.end())
    throw ConfigError(Concat("missing key '", key, "': a number is needed"));
  it->second.used = true;
  return it->second.value;
}

int Settings::Int(std::string_view key, int low) const {
  const double x = Real(key);
  if (x != std::floor(x) || x < low || x > std::numeric_limits<int>::max()) {
    throw ConfigError(Concat(Origin(key), ": '", key, "' is ", x, ", not a whole number >= ", low));
  }
  return static_cast<int>(x);
}

std::vector<std::string> Settings::Unused() const {
  std::vector<std::string> keys;
  for (const auto& [key, entry] : entries_) {
    if (!entry.used) keys.push_back(key);
  }
  return keys;
}

std::string Settings::Origin(std::string_view key) const {
  const auto it = entries_.find(key);
  return it == entries_.end() ? std::string() : it->second.origin;
}

std::vector<std::pair<std::string, double>> Settings::Items() const {
  std::vector<std::pair<std::string, double>> items;
  for (const auto& [key, entry] : entries_) items.emplace_back(key, entry.value);
  return items;
}

}  // namespace o2v
