#pragma once
/// The types of numbers in image files, and their conversion to floats.

#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace esvr::samples {

/// Numbers of one type among the bytes of a file. Between the wanted ones may lie those of other
/// components.
struct EncodedValues {
  std::span<const std::byte> bytes;
  bool bigEndian = false;
  std::size_t first = 0;  ///< index of the first wanted number: the component
  std::size_t step = 1;   ///< from one wanted number to the next: the number of components
};

struct ElementType {
  const char* name;  ///< "uint8"
  std::size_t bytes;
  std::optional<double> maximum;  ///< largest value of an integer type
  /// Converts as many numbers as `out` has. Integers above 2^24 and doubles are rounded.
  void (*decode)(const EncodedValues& values, std::span<float> out);
};

/// \throws UsageError  there is no such type; the text lists all of them
[[nodiscard]] const ElementType& elementType(const std::string& name);

/// The names of all types: "uint8, int8, ...".
[[nodiscard]] std::string elementTypeNames();

}  // namespace esvr::samples
