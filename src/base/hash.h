#pragma once
// A hash for names and file contents. Finds accidents, not attacks.

#include <cstdint>
#include <string_view>

namespace o2v {

/// FNV-1a, 64 bits, continued from `h`; the default is its offset basis. Every single changed byte
/// changes the result. Constants of Fowler, Noll and Vo.
inline std::uint64_t Fnv1a(std::string_view bytes, std::uint64_t h = 0xcbf29ce484222325u) {
  for (const char c : bytes) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return h;
}

}  // namespace o2v
