#pragma once
/// Bytes of a file: writing and reading values, the checksum, and the sources from which a container is read piece by
/// piece, so that a reader loads only what it needs, and allocates memory only for bytes that exist.

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <ranges>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/counted.h"
#include "esvr/error.h"

struct XXH64_state_s;

namespace esvr::format {

// ---- Values

static_assert(std::endian::native == std::endian::little,
              "numbers are copied to and from the file as they lie in memory");

/// Writes values as little-endian bytes.
class ByteWriter {
 public:
  static constexpr bool kReads = false;

  template <class T>
  requires std::is_arithmetic_v<T>
  void put(T value) { putAll(std::span<const T>(&value, 1)); }

  template <std::ranges::contiguous_range Values>
  void putAll(const Values& values) {
    const auto bytes = std::as_bytes(std::span(values));
    const std::size_t before = bytes_.size();
    bytes_.resize(before + bytes.size());
    std::ranges::copy(bytes, bytes_.begin() + std::ptrdiff_t(before));
  }

  /// Writes a length in 32 bits and then the bytes.
  /// \throws RuntimeFailure  there are 4 GiB or more
  void putSized(std::span<const std::byte> bytes) {
    if (bytes.size() > std::numeric_limits<std::uint32_t>::max())
      throw RuntimeFailure("a name or a metadata value has 4 GiB or more");
    put(std::uint32_t(bytes.size()));
    putAll(bytes);
  }
  void putSized(std::string_view text) {
    putSized(std::as_bytes(std::span(text.data(), text.size())));
  }

  void padTo(std::uint64_t size) { bytes_.resize(size); }

  [[nodiscard]] std::uint64_t size() const { return bytes_.size(); }
  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }
  [[nodiscard]] std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

/// Reads little-endian values from bytes, and never past their end.
class ByteReader {
 public:
  static constexpr bool kReads = true;

  /// \param where  start of every error text: "file: section"
  ByteReader(std::span<const std::byte> bytes, std::string where)
      : bytes_(bytes), where_(std::move(where)) {}

  template <class T>
  requires std::is_arithmetic_v<T>
  [[nodiscard]] T get() {
    T value;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }

  /// An enumeration in one byte with the values 0 to `last`.
  template <class Enum>
  [[nodiscard]] Enum getEnum(Enum last, const char* what) {
    const auto value = get<std::uint8_t>();
    if (value > static_cast<std::uint8_t>(last))
      fail(std::string("unknown ") + what + " " + std::to_string(value));
    return static_cast<Enum>(value);
  }

  /// A length in 32 bits, and then as many bytes.
  [[nodiscard]] std::span<const std::byte> getSized() { return take(get<std::uint32_t>()); }
  [[nodiscard]] std::string getString() {
    const auto bytes = getSized();
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  [[nodiscard]] std::vector<std::byte> getBlob() {
    const auto bytes = getSized();
    return {bytes.begin(), bytes.end()};
  }

  /// The next n bytes, unchanged.
  [[nodiscard]] std::span<const std::byte> getBytes(std::size_t n) { return take(n); }

  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }

  /// Refuses bytes that have not been read.
  void finish() const {
    if (left() != 0) fail(counted(left(), "byte") + " too many");
  }

  /// Refuses unread bytes that are not zero.
  void finishZeros() {
    while (left() != 0)
      if (get<std::uint8_t>() != 0) fail("has content after its end");
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw BadInput(where_ + ": " + what + " (offset " + std::to_string(at_) + " in the content)");
  }

 private:
  std::span<const std::byte> take(std::size_t n) {
    if (n > left()) fail("ends within a value of " + counted(n, "byte"));
    const auto taken = bytes_.subspan(at_, n);
    at_ += n;
    return taken;
  }

  std::span<const std::byte> bytes_;
  std::string where_;
  std::size_t at_ = 0;
};

// One description of a record serves both sides: code...(side, value) writes the value to a ByteWriter, or reads it from a
// ByteReader, so that they cannot differ.

template <class Side, class T>
using Coded = std::conditional_t<Side::kReads, T, const T>;

template <class T>
void code(ByteWriter& out, const T& value) {
  out.put(value);
}
template <class T>
void code(ByteReader& in, T& value) {
  value = in.get<T>();
}

/// A number that the file has in another type. A reader need not check its range.
template <class Stored, class T>
void codeAs(ByteWriter& out, const T& value) {
  out.put(static_cast<Stored>(value));
}
template <class Stored, class T>
void codeAs(ByteReader& in, T& value) {
  value = static_cast<T>(in.get<Stored>());
}

/// An enumeration in one byte. A reader refuses what is above `last`.
template <class Enum>
void codeEnum(ByteWriter& out, const Enum& value, Enum /*last*/, const char* /*what*/) {
  out.put(static_cast<std::uint8_t>(value));
}
template <class Enum>
void codeEnum(ByteReader& in, Enum& value, Enum last, const char* what) {
  value = in.getEnum(last, what);
}
inline void codeFlag(ByteWriter& out, const bool& value, const char* /*what*/) {
  out.put(std::uint8_t(value));
}
inline void codeFlag(ByteReader& in, bool& value, const char* what) {
  value = in.getEnum(std::uint8_t{1}, what) != 0;
}

/// A length in 32 bits, and as many bytes.
template <class Bytes>
void codeSized(ByteWriter& out, const Bytes& value) {
  out.putSized(value);
}
inline void codeSized(ByteReader& in, std::string& value) { value = in.getString(); }
inline void codeSized(ByteReader& in, std::vector<std::byte>& value) { value = in.getBlob(); }

// Varints: unsigned integers in as few bytes as they need, with 7 bits a byte, the lowest first. The highest bit of a
// byte says that another one follows.

inline void putVarint(ByteWriter& out, std::uint64_t value) {
  constexpr std::uint64_t kMore = 0x80;
  for (; value >= kMore; value >>= 7) out.put(std::uint8_t((value & (kMore - 1)) | kMore));
  out.put(std::uint8_t(value));
}

/// \throws BadInput  the integer has more than 64 bits
[[nodiscard]] inline std::uint64_t getVarint(ByteReader& in) {
  std::uint64_t value = 0;
  for (int shift = 0;; shift += 7) {
    const std::uint64_t bits = in.get<std::uint8_t>();
    if (shift > 63 || (shift == 63 && bits > 1)) in.fail("an integer has more than 64 bits");
    value |= (bits & 0x7f) << shift;
    if ((bits & 0x80) == 0) return value;
  }
}

// ---- The checksum of the format: XXH64 with seed 0

[[nodiscard]] std::uint64_t checksum(std::span<const std::byte> bytes);

/// The checksum of bytes that come in pieces.
class RunningChecksum {
 public:
  RunningChecksum();
  void add(std::span<const std::byte> piece);
  [[nodiscard]] std::uint64_t value() const;

 private:
  struct Free {
    void operator()(XXH64_state_s* state) const;
  };
  std::unique_ptr<XXH64_state_s, Free> state_;
};

// ---- Sources

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
