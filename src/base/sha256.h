#pragma once
// SHA-256, to say which file it was: the hash that pins name and `sha256sum` prints.

#include <string>
#include <string_view>

namespace o2v {

/// The hash of the bytes, 64 lower-case hexadecimal digits. Source: FIPS 180-4.
std::string Sha256(std::string_view bytes);

}  // namespace o2v
