#pragma once
/// A file that appears under its name only when it is complete. It is written beside the target
/// under a temporary name, flushed to the disk and renamed.

#include <cstddef>
#include <filesystem>
#include <span>

#include "core/temporary_files.h"

namespace esvr {

/// A file that is being written. Nothing is left of it if it is destroyed before commit(). A
/// temporary file of a process that was killed is removed by the next AtomicFile in the same
/// directory.
/// Every failure is a RuntimeFailure that names the target.
class AtomicFile {
 public:
  /// Refuses a target that exists (without `overwrite`) or is not a regular file, and creates the
  /// temporary file in the target's directory. A symbolic link is followed.
  AtomicFile(const std::filesystem::path& target, bool overwrite);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// The path of the temporary file, for libraries that open files by name.
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return temporary_.path; }

  /// Appends to the temporary file.
  void write(std::span<const std::byte> bytes);

  /// Flushes and renames the file. Without `overwrite` it fails if the target has appeared
  /// meanwhile.
  void commit();

 private:
  std::filesystem::path target_;
  TemporaryFile temporary_;
  bool overwrite_;
  bool committed_ = false;
};

}  // namespace esvr
