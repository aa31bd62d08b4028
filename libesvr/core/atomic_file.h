#pragma once
/// A file that appears under its name only when it is complete: written beside the target under a
/// temporary name, flushed to the disk and renamed.

#include <cstddef>
#include <filesystem>
#include <span>

#include "core/temporary_files.h"

namespace esvr {

/// One file on its way. Destroyed before commit(), it leaves nothing behind. What a process that was
/// killed left behind is removed by the next AtomicFile in the same directory.
/// Every failure is thrown as RuntimeFailure that names the target.
class AtomicFile {
 public:
  /// Refuses a target that exists (without `overwrite`) or is not a regular file, then creates the
  /// temporary file exclusively in the target's directory. A symbolic link is followed.
  AtomicFile(const std::filesystem::path& target, bool overwrite);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// The temporary file: for libraries that write by name.
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return temporary_.path; }

  /// Appends to the temporary file.
  void write(std::span<const std::byte> bytes);

  /// Flushes and renames. Without `overwrite`, a target that appeared meanwhile is kept and this
  /// fails.
  void commit();

 private:
  [[noreturn]] void fail(const char* what, int error) const;
  void rename();

  std::filesystem::path target_;
  TemporaryFile temporary_;
  bool overwrite_;
  bool committed_ = false;
};

}  // namespace esvr
