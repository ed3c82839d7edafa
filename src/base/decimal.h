#pragma once
// Numbers as text.

#include <charconv>
#include <concepts>
#include <iterator>
#include <string>

namespace o2v {

/// The shortest decimal that reads back to the same number ("0.1", "1e-08", "nan"). A flag is 0
/// or 1.
template <typename Number>
requires std::integral<Number> || std::floating_point<Number> std::string Decimal(Number x) {
  char text[32];  // a double needs at most 24
  if constexpr (std::same_as<Number, bool>) {
    return x ? "1" : "0";
  } else {
    return {text, std::to_chars(text, std::end(text), x).ptr};
  }
}

}  // namespace o2v
