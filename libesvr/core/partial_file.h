#pragma once
/// A file that grows under a name of its own until it is complete, and that a later process can
/// continue.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace esvr {

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
  void lock();
  bool open(PartialStart start);

  std::filesystem::path target_, path_;
  bool overwrite_;
  int fd_ = -1;
};

}  // namespace esvr
