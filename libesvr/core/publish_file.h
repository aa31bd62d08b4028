#pragma once
/// Gives a complete file its final name.

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <span>

namespace esvr {

/// Opens those of the descriptors 0, 1 and 2 that are closed, so that reading from them and writing to
/// them fail as before. Otherwise the next file would get such a number, and what the process, or a
/// library in it, prints would be written into that file. Every file that is written is opened after
/// this; programs call it before anything else.
void keepStandardDescriptors();

/// Permissions of a new file; the umask of the process reduces them.
inline constexpr mode_t kNewFileMode = 0666;

/// The file that a path leads to, so that a symbolic link is not replaced.
[[nodiscard]] std::filesystem::path followLinks(const std::filesystem::path& path);

/// Whether a path leads to something that is written directly, because it cannot be replaced by a file: a
/// device, a pipe or a socket, such as /dev/null, /dev/stdout or the >(...) of a shell.
[[nodiscard]] bool isWrittenDirectly(const std::filesystem::path& path);

/// Refuses a target that exists (without `overwrite`) or is not a regular file.
/// \return whether it exists
/// \throws RuntimeFailure
bool checkTarget(const std::filesystem::path& target, bool overwrite);

/// Renames a file that was flushed, and flushes the folder.
/// \throws RuntimeFailure  the target exists (without `overwrite`) or cannot be written
void publishFile(const std::filesystem::path& file, const std::filesystem::path& target,
                 bool overwrite);

/// Throws a RuntimeFailure that has a verb phrase, a path and the text of a system error.
[[noreturn]] void failAt(const char* what, const std::filesystem::path& path, int error);

/// Writes all bytes to an open file. \param path  name of the file in error texts
/// \throws RuntimeFailure
void writeAll(int fd, std::span<const std::byte> bytes, const std::filesystem::path& path);

}  // namespace esvr
