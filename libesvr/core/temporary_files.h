#pragma once
/// Temporary files. Those of AtomicFile have names: a process locks the file that it writes, and the system releases
/// the lock when the process ends for any reason. A file without a lock is therefore left over.

#include <sys/types.h>

#include <filesystem>

namespace esvr {

struct TemporaryFile {
  std::filesystem::path path;
  int fd = -1;  ///< open for writing and locked; -1: creation failed, see errno
};

/// Creates a file with a new name in a directory.
[[nodiscard]] TemporaryFile createTemporary(const std::filesystem::path& directory, mode_t mode);

/// Creates a file without a name, which the system removes when it is closed. Its owner alone may
/// read and write it. \return -1 if this failed, see errno
[[nodiscard]] int createNameless(const std::filesystem::path& directory);

/// Removes this user's temporary files in a directory whose processes have ended. Errors are
/// ignored; files that cannot be removed stay.
void removeLeftOvers(const std::filesystem::path& directory);

}  // namespace esvr
