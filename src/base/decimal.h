#pragma once
// Numbers as text.

#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

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

/// A number that a person wrote: all of the text, decimal, leading zeros allowed. Nothing for what
/// is no number of the type or does not fit into it.
template <typename Number>
std::optional<Number> ReadDecimal(std::string_view text) {
  Number x{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return x;
}

/// The whole number that x is, as in 1e3; nothing for a fraction and beyond 2^53, where a double
/// no longer tells whole numbers apart.
inline std::optional<std::int64_t> Whole(double x) {
  if (x != std::floor(x) || std::abs(x) > 0x1p53) return std::nullopt;
  return static_cast<std::int64_t>(x);
}
/// A whole number as text: 1000, 01000 or 1e3.
inline std::optional<std::int64_t> ReadWhole(std::string_view text) {
  if (const auto x = ReadDecimal<std::int64_t>(text)) return x;
  const auto x = ReadDecimal<double>(text);
  return x ? Whole(*x) : std::nullopt;
}
/// A finite number as text.
inline std::optional<double> ReadReal(std::string_view text) {
  const auto x = ReadDecimal<double>(text);
  return x && std::isfinite(*x) ? x : std::nullopt;
}

}  // namespace o2v
