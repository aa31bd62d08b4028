#include "images/element_type.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "esvr/error.h"

namespace esvr::samples {
namespace {

static_assert(std::endian::native == std::endian::little,
              "values are swapped for big-endian files");

/// A number of IEEE 754's binary16.
struct Half {
  std::uint16_t bits;
  explicit operator float() const {
    constexpr int kMantissaBits = 10, kLargestExponent = 31, kBias = 15;
    const int mantissa = bits & ((1 << kMantissaBits) - 1);
    const int exponent = (bits >> kMantissaBits) & kLargestExponent;
    const float sign = bits >> 15 ? -1.0f : 1.0f;
    if (exponent == kLargestExponent)
      return mantissa ? std::numeric_limits<float>::quiet_NaN()
                      : sign * std::numeric_limits<float>::infinity();
    const int leading = exponent ? 1 << kMantissaBits : 0;  // small numbers have no leading bit
    return sign *
           std::ldexp(float(leading + mantissa), std::max(exponent, 1) - kBias - kMantissaBits);
  }
};

template <class T>
void decodeAs(const EncodedValues& values, std::span<float> out) {
  const std::byte* at = values.bytes.data() + values.first * sizeof(T);
  for (float& number : out) {
    std::byte bytes[sizeof(T)];
    std::memcpy(bytes, at, sizeof bytes);
    if (values.bigEndian) std::reverse(std::begin(bytes), std::end(bytes));
    number = float(std::bit_cast<T>(bytes));
    at += values.step * sizeof(T);
  }
}

template <class T>
ElementType typeWithName(const char* name) {
  std::optional<double> maximum;
  if constexpr (std::is_integral_v<T>) maximum = double(std::numeric_limits<T>::max());
  return {name, sizeof(T), maximum, decodeAs<T>};
}

std::span<const ElementType> allTypes() {
  static const ElementType kTypes[] = {
      typeWithName<std::uint8_t>("uint8"),   typeWithName<std::int8_t>("int8"),
      typeWithName<std::uint16_t>("uint16"), typeWithName<std::int16_t>("int16"),
      typeWithName<std::uint32_t>("uint32"), typeWithName<std::int32_t>("int32"),
      typeWithName<std::uint64_t>("uint64"), typeWithName<std::int64_t>("int64"),
      typeWithName<Half>("float16"),         typeWithName<float>("float32"),
      typeWithName<double>("float64")};
  return kTypes;
}

}  // namespace

const ElementType& elementType(const std::string& name) {
  for (const ElementType& type : allTypes())
    if (name == type.name) return type;
  throw UsageError("unknown type '" + name + "'; the types are " + elementTypeNames());
}

std::string elementTypeNames() {
  std::string names;
  for (const ElementType& type : allTypes())
    names += (names.empty() ? "" : ", ") + std::string(type.name);
  return names;
}

}  // namespace esvr::samples
