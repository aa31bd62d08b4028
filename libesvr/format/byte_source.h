#pragma once
/// Sources of a container's bytes, which are read piece by piece, so that nothing is read that is
/// not needed and nothing is allocated for what is not there.

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

  /// The bytes [offset, offset + n). \throws BadInput  beyond the end (before it allocates)
  [[nodiscard]] std::vector<std::byte> read(std::uint64_t offset, std::uint64_t n) const;

  /// Bytes that have been read so far, again those that were read twice.
  [[nodiscard]] std::uint64_t bytesRead() const { return bytesRead_; }

 private:
  virtual void fill(std::uint64_t offset, std::span<std::byte> out) const = 0;

  std::string name_;
  mutable std::uint64_t bytesRead_ = 0;
};

/// Bytes in memory, which must outlive the source.
class MemorySource : public ByteSource {
 public:
  MemorySource(std::span<const std::byte> bytes, std::string name)
      : ByteSource(std::move(name)), bytes_(bytes) {}
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }

 private:
  void fill(std::uint64_t offset, std::span<std::byte> out) const override;

  std::span<const std::byte> bytes_;
};

/// Bytes of its own.
class BufferSource : public ByteSource {
 public:
  BufferSource(std::vector<std::byte> bytes, std::string name)
      : ByteSource(std::move(name)), bytes_(std::move(bytes)) {}
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }

 private:
  void fill(std::uint64_t offset, std::span<std::byte> out) const override;

  std::vector<std::byte> bytes_;
};

/// A part of another source, which must outlive this one.
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

/// \throws BadInput  missing, not readable, not a regular file
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
