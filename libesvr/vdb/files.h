#pragma once
/// An input file of which every size is checked before it is used, so that nothing is allocated or
/// skipped beyond its end, and errors of OpenVDB, NanoVDB and the streams as errors of this library.
/// Functions of this folder throw errors without the name of the file. Their callers add it, and the
/// name of the grid.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "esvr/grid.h"

namespace esvr::vdb {

/// A file that is read from front to back. Its own errors are BadInput.
class InputFile {
 public:
  /// \throws BadInput  the file is missing, a directory or another special file, empty, or not
  ///                   readable
  explicit InputFile(const std::filesystem::path& path);
  /// Bytes in memory, which must outlive this object, in place of a file.
  explicit InputFile(std::span<const std::byte> bytes);

  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] std::uint64_t position() const { return position_; }
  [[nodiscard]] std::uint64_t remaining() const { return end_ - position_; }

  /// While it exists, the file ends at a position, so that a part of it cannot reach into the next
  /// part. Objects may be nested; an inner one cannot go beyond an outer one.
  class Within {
   public:
    /// \throws BadInput  the file has fewer bytes
    Within(InputFile& file, std::uint64_t end);
    ~Within() { file_.end_ = before_; }
    Within(const Within&) = delete;
    Within& operator=(const Within&) = delete;

   private:
    InputFile& file_;
    std::uint64_t before_;
  };

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
  /// A string as OpenVDB stores it: a 32-bit length and the characters.
  std::string readString();

  /// The stream at position(), from which a library may read. It throws std::ios_base::failure at
  /// the end of the file. position() does not change before followStream() or seek() is called.
  std::istream& stream() { return *stream_; }
  /// \throws BadInput  the library has read beyond the end that a Within has set
  void followStream();

 private:
  void throwAtErrors();
  [[nodiscard]] std::string endText() const;

  std::vector<char> buffer_;
  std::unique_ptr<std::streambuf> memory_;  ///< null: a file
  std::unique_ptr<std::istream> stream_;
  std::uint64_t size_ = 0;
  std::uint64_t end_ = 0;  ///< at most size_
  std::uint64_t position_ = 0;
};

/// Rethrows the current exception as an esvr::Error whose text begins with `where`. The library's
/// own errors keep their type; exceptions of the VDB libraries become BadInput.
[[noreturn]] void rethrowWhileReading(const std::string& where);
/// The same for writing, where exceptions of the VDB libraries become RuntimeFailure.
[[noreturn]] void rethrowWhileWriting(const std::string& where);

/// Runs `body` and adds `path` to the text of its errors.
template <class Body>
decltype(auto) whileReading(const std::filesystem::path& path, Body&& body) {
  try {
    return std::forward<Body>(body)();
  } catch (...) {
    rethrowWhileReading(path.string() + ": ");
  }
}

/// Runs `body` and adds the name of a grid to the text of its errors. It is used inside
/// whileReading.
/// \param nameOf  gives the name as users see it; it is called if there is an error
template <class NameOf, class Body>
decltype(auto) inNamedGrid(const NameOf& nameOf, Body&& body) {
  try {
    return std::forward<Body>(body)();
  } catch (...) {
    rethrowWhileReading("grid \"" + nameOf() + "\": ");
  }
}

/// The same for a name from a file.
template <class Body>
decltype(auto) inGrid(const std::string& name, Body&& body) {
  return inNamedGrid([&] { return shownName(name); }, std::forward<Body>(body));
}

template <class Body>
decltype(auto) whileWriting(const std::filesystem::path& path, Body&& body) {
  try {
    return std::forward<Body>(body)();
  } catch (...) {
    rethrowWhileWriting(path.string() + ": ");
  }
}

}  // namespace esvr::vdb
