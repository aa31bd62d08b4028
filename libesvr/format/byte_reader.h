#pragma once
/// Reads little-endian values from bytes, and never past their end.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "esvr/error.h"

namespace esvr::format {

class ByteReader {
 public:
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
    if (left() != 0) fail(std::to_string(left()) + " bytes too many");
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
    if (n > left()) fail("ends within a value of " + std::to_string(n) + " bytes");
    const auto taken = bytes_.subspan(at_, n);
    at_ += n;
    return taken;
  }

  std::span<const std::byte> bytes_;
  std::string where_;
  std::size_t at_ = 0;
};

}  // namespace esvr::format
