#pragma once
/// Sources from which the bytes of a container are read piece by piece, so that a reader loads only
/// what it needs, and allocates memory only for bytes that exist.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace esvr::format {

class ByteSource {
 public:
  explicit ByteSource(std::string name) : name_(std::move(name)) {}
  virtual ~ByteSource() = default;
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] virtual std::uint64_t size() const = 0;

  /// Reads the bytes [offset, offset + n).
  /// \throws BadInput  they reach beyond the end; nothing is allocated then
  [[nodiscard]] std::vector<std::byte> read(std::uint64_t offset, std::uint64_t n) const;

  /// Number of bytes that have been read so far; bytes that are read twice count twice.
  [[nodiscard]] std::uint64_t bytesRead() const { return bytesRead_; }

 private:
  virtual void fill(std::uint64_t offset, std::span<std::byte> out) const = 0;

  std::string name_;
  mutable std::uint64_t bytesRead_ = 0;
};

/// Reads bytes in memory, which must outlive the source.
class MemorySource : public ByteSource {
 public:
  MemorySource(std::span<const std::byte> bytes, std::string name)
      : ByteSource(std::move(name)), bytes_(bytes) {}
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }

 private:
  void fill(std::uint64_t offset, std::span<std::byte> out) const override;

  std::span<const std::byte> bytes_;
};

/// Reads bytes that it owns.
class BufferSource : public ByteSource {
 public:
  BufferSource(std::vector<std::byte> bytes, std::string name)
      : ByteSource(std::move(name)), bytes_(std::move(bytes)) {}
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }

 private:
  void fill(std::uint64_t offset, std::span<std::byte> out) const override;

  std::vector<std::byte> bytes_;
};

/// Reads a part of another source, which must outlive this one.
class PartSource : public ByteSource {
 public:
  PartSource(const ByteSource& whole, std::uint64_t offset, std::uint64_t size, std::string name)
      : ByteSource(std::move(name)), whole_(whole), offset_(offset), size_(size) {}
  [[nodiscard]] std::uint64_t size() const override { return size_; }

 private:
  void fill(std::uint64_t offset, std::span<std::byte> out) const override;

  const ByteSource& whole_;
  std::uint64_t offset_, size_;
};

/// Reads a file.
/// \throws BadInput  the file is missing, not readable, or not a regular file
class FileSource : public ByteSource {
 public:
  explicit FileSource(const std::filesystem::path& path);
  ~FileSource() override;
  [[nodiscard]] std::uint64_t size() const override { return size_; }

 private:
  void fill(std::uint64_t offset, std::span<std::byte> out) const override;

  int fd_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace esvr::format
