#pragma once
/// Output files, which appear under their names only when they are complete. An AtomicFile is written
/// beside its target under a temporary name; a PartialFile grows under a name of its own, and a later
/// process can continue it. Below them are the parts that they share.

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
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

/// A temporary file with a name. A process locks the file that it writes, and the system releases the lock
/// when the process ends for any reason. A file without a lock is therefore left over.
struct TemporaryFile {
  std::filesystem::path path;
  int fd = -1;  ///< open for writing and locked; -1: creation failed, see errno
};

/// Creates a file without a name, which the system removes when it is closed. Its owner alone may
/// read and write it. \return -1 if this failed, see errno
[[nodiscard]] int createNameless(const std::filesystem::path& directory);

/// A file that is written beside the target under a temporary name, flushed to the disk and renamed.
/// Nothing is left of it if it is destroyed before commit(). A temporary file of a process that was killed
/// is removed by the next AtomicFile in the same directory.
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

/// What happens to the partial file of an earlier process.
enum class PartialStart {
  kRefuse,   ///< it is an error
  kContinue  ///< its content is kept; it need not exist
};

/// The file TARGET.partial, which is locked as long as the object exists. It stays if the object is
/// destroyed before commit(), unless it has no content.
/// Every failure is a RuntimeFailure that names the file.
class PartialFile {
 public:
  /// Refuses a target that exists (without `overwrite`), and a partial file that another process
  /// writes.
  PartialFile(const std::filesystem::path& target, bool overwrite, PartialStart start);
  ~PartialFile();
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  /// TARGET.partial
  [[nodiscard]] static std::filesystem::path pathFor(const std::filesystem::path& target);
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  [[nodiscard]] std::uint64_t size() const;

  void append(std::span<const std::byte> bytes);
  /// Overwrites bytes at the beginning.
  void replaceStart(std::span<const std::byte> bytes);
  /// Removes what follows the first `size` bytes.
  void truncate(std::uint64_t size);
  /// Writes the content to the disk.
  void flush();
  /// Flushes the file and renames it to the target.
  void commit();

 private:
  bool open(PartialStart start);

  std::filesystem::path target_, path_;
  bool overwrite_;
  int fd_ = -1;
};

/// Removes this user's temporary files in a directory whose processes have ended. Errors are
/// ignored; files that cannot be removed stay.
void removeLeftOvers(const std::filesystem::path& directory);

/// Throws a RuntimeFailure that has a verb phrase, a path and the text of a system error.
[[noreturn]] void failAt(const char* what, const std::filesystem::path& path, int error);

/// Writes all bytes to an open file. \param path  name of the file in error texts
/// \throws RuntimeFailure
void writeAll(int fd, std::span<const std::byte> bytes, const std::filesystem::path& path);

}  // namespace esvr
