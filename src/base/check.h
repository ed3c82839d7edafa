#pragma once
// The one way to fail: exceptions with a message that says what was expected and what came.

#include <sstream>
#include <stdexcept>
#include <string>

namespace o2v {

/// A broken contract. Exit code 1.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Bad user input: the message names the file, the line and the key where there is one. Exit
/// code 2.
struct ConfigError : Error {
  using Error::Error;
};

/// A non-finite value or a simulator warning. Exit code 3.
struct DivergedError : Error {
  using Error::Error;
};

/// The parts, written one after the other.
template <typename... Parts>
std::string Concat(const Parts&... parts) {
  std::ostringstream out;
  (out << ... << parts);
  return out.str();
}

/// Throws Error with the parts as its message unless `ok`. Active in release builds.
template <typename... Parts>
void Check(bool ok, const Parts&... parts) {
  if (!ok) [[unlikely]] {
    throw Error(Concat(parts...));
  }
}

}  // namespace o2v
