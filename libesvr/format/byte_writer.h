#pragma once
/// Writes values as little-endian bytes.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <ranges>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include "esvr/error.h"

namespace esvr::format {

static_assert(std::endian::native == std::endian::little,
              "numbers are copied to and from the file as they lie in memory");

class ByteWriter {
 public:
  template <class T>
  requires std::is_arithmetic_v<T>
  void put(T value) { putAll(std::span<const T>(&value, 1)); }

  template <std::ranges::contiguous_range Values>
  void putAll(const Values& values) {
    append(std::as_bytes(std::span(values)));
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
  void append(std::span<const std::byte> bytes);

  std::vector<std::byte> bytes_;
};

}  // namespace esvr::format
