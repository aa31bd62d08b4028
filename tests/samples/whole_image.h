#pragma once
/// What the tests of image formats share.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "images/image_source.h"

namespace esvr::samples {

/// All voxels of an image, read in slabs of two slices.
inline std::vector<float> wholeImage(ImageSource& image) {
  const Coord size = image.size();
  const std::size_t area = std::size_t(size.x) * std::size_t(size.y);
  std::vector<float> values(area * std::size_t(size.z));
  for (std::int32_t z = 0; z < size.z; z += 2) {
    const std::int32_t slices = std::min(2, size.z - z);
    image.read({z, slices},
               std::span(values).subspan(std::size_t(z) * area, std::size_t(slices) * area));
  }
  return values;
}

/// A number as bytes in either order.
template <class T>
std::string bytesOf(T value, bool big = false) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return big ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

/// Numbers as bytes.
template <class T>
std::string bytesOf(const std::vector<T>& values, bool big = false) {
  std::string bytes;
  for (const T& value : values) bytes += bytesOf(value, big);
  return bytes;
}

/// 0, 1, 2, ... as numbers of a type, which may be cut to its bits; a signed one begins at -3.
template <class T>
std::vector<T> countingValues(std::int64_t count) {
  const std::int64_t first = T(-1) < T(0) ? -3 : 0;
  std::vector<T> values;
  for (std::int64_t i = 0; i < count; ++i) values.push_back(T(first + i));
  return values;
}

template <class T>
std::vector<float> asFloats(const std::vector<T>& values) {
  std::vector<float> floats;
  for (const T& value : values) floats.push_back(float(value));
  return floats;
}

}  // namespace esvr::samples
