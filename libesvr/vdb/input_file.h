#pragma once
/// A file read front to back with every size checked before it is believed: nothing is allocated or
/// skipped beyond the file's end. Errors are BadInput without the file's name; the callers at the
/// library's border add it (errors.h).

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <type_traits>
#include <vector>

namespace esvr::vdb {

class InputFile {
 public:
  /// \throws BadInput  missing, a directory or other special file, empty, not readable
  explicit InputFile(const std::filesystem::path& path);

  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] std::uint64_t position() const { return position_; }
  [[nodiscard]] std::uint64_t remaining() const { return size_ - position_; }

  /// \throws BadInput  fewer than `bytes` are left
  void need(std::uint64_t bytes) const;
  void seek(std::uint64_t position);
  void skip(std::uint64_t bytes);
  void read(void* to, std::size_t bytes);

  template <class T>
  T read() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value;
    read(&value, sizeof value);
    return value;
  }
  std::vector<std::byte> readBytes(std::uint64_t bytes);
  /// A string as OpenVDB stores it: 32-bit length, then the characters.
  std::string readString();

  /// The stream, at position(), for a library to read from; it throws std::ios_base::failure at the
  /// file's end. position() holds the old place until followStream() or seek().
  std::istream& stream() { return stream_; }
  void followStream();

 private:
  std::vector<char> buffer_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;
};

}  // namespace esvr::vdb
