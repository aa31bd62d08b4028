#pragma once
/// Where a container's bytes come from: read piece by piece, so that nothing is read that is not
/// needed and nothing is allocated for what is not there.

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

 private:
  virtual void fill(std::uint64_t offset, std::span<std::byte> out) const = 0;

  std::string name_;
};

class MemorySource : public ByteSource {
 public:
  MemorySource(std::span<const std::byte> bytes, std::string name)
      : ByteSource(std::move(name)), bytes_(bytes) {}
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }

 private:
  void fill(std::uint64_t offset, std::span<std::byte> out) const override;

  std::span<const std::byte> bytes_;
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
