#pragma once
// Whole files in, whole files out.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace o2v {

/// Opens the standard streams that are closed, on the null device: the first files that a program
/// opens would otherwise be taken for them.
void OpenStandardStreams();

/// A folder as it is named: "run/", "./run" and "run/." are "run"; "." and "..", which are names of
/// none, become absolute. Files beside the folder derive from this. Throws ConfigError for "" and
/// "/".
std::filesystem::path FolderPath(const std::filesystem::path& dir);

/// Throws ConfigError with the system's reason unless WriteFileAtomically could write a file here.
/// Leaves nothing behind.
void RequireWritable(const std::filesystem::path& path);

/// True for a device, a pipe or a socket, also at the end of a link: there is nothing beside it.
bool IsStream(const std::filesystem::path& path);

/// The bytes of a file. Throws Error naming the file and the system's reason.
std::string ReadFile(const std::filesystem::path& path);

/// Bytes that ".<8 digits>.tmp" adds to the name of a file that is not whole yet.
inline constexpr std::size_t kTemporaryEnding = sizeof ".01234567.tmp" - 1;
/// True for a name with such an ending. Only a process that was killed leaves the file behind.
bool IsTemporary(const std::filesystem::path& path);

/// Replaces a file so that it is always whole, also when several processes write it at once: the
/// text goes to a temporary file of the process's own, to the disk, is renamed to `path`, and the
/// folder goes to the disk. `before_rename`, where given, is called before the rename: the moment
/// at which the tests of killed runs strike. A link stays, and the file that it leads to is
/// replaced; a device or a pipe is written into. Throws Error naming the file and the system's
/// reason.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view text,
                         const std::function<void()>& before_rename = {});

/// Appends to a file, which is made where there is none. Throws Error naming the file and the
/// system's reason.
void AppendToFile(const std::filesystem::path& path, std::string_view text);

/// Brings a file that others have written to the disk. Throws Error naming the file and the
/// system's reason.
void SyncFile(const std::filesystem::path& path);

/// Writes all of the text into an open descriptor. Throws Error with `name` and the system's
/// reason.
void WriteAll(int fd, const std::string& name, std::string_view text);

}  // namespace o2v
