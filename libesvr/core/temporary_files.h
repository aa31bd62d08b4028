#pragma once
/// Temporary files of AtomicFile. The process that writes one holds a lock on it, which the system
/// releases when the process ends, however it ends: a file without a lock is left over.

#include <sys/types.h>

#include <filesystem>

namespace esvr {

struct TemporaryFile {
  std::filesystem::path path;
  int fd = -1;  ///< open for writing and locked; -1: could not be created, and errno says why
};

/// Creates a file that no other process has, beside the files of a directory.
[[nodiscard]] TemporaryFile createTemporary(const std::filesystem::path& directory, mode_t mode);

/// Removes this user's temporary files in a directory whose processes have ended. Errors are no
/// failures: what cannot be removed stays.
void removeLeftOvers(const std::filesystem::path& directory);

}  // namespace esvr
