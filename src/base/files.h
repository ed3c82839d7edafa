#pragma once
// Whole files in, whole files out.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace o2v {

/// The bytes of a file. Throws Error naming the file and the system's reason.
std::string ReadFile(const std::filesystem::path& path);

/// Replaces a file so that it is always whole: the text goes to `<path>.tmp`, to the disk, and is
/// renamed to `path`. `before_rename`, where given, is called in between: the moment at which the
/// tests of killed runs strike. Throws Error naming the file and the system's reason.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view text,
                         const std::function<void()>& before_rename = {});

/// Brings a file that others have written to the disk. Throws Error naming the file and the
/// system's reason.
void SyncFile(const std::filesystem::path& path);

}  // namespace o2v
