#pragma once
// Text from elsewhere, safe to show.

#include <string>
#include <string_view>

namespace o2v {

/// The text as one line without what a terminal obeys: control characters, as bytes and as UTF-8
/// (U+0080 to U+009F), become '?'.
inline std::string Printable(std::string_view text) {
  std::string shown;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const auto next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0;
    const bool wide = c == 0xC2 && next >= 0x80 && next < 0xA0;
    shown += c < 32 || c == 127 || wide ? '?' : text[i];
    i += wide;
  }
  return shown;
}

}  // namespace o2v
