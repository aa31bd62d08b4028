#pragma once
/// Integer coordinates and boxes, in voxels of a grid's index space.

#include <algorithm>
#include <compare>
#include <cstdint>
#include <limits>
#include <string>

namespace esvr {

/// The integer coordinates of a voxel. They are ordered lexicographically by x, y, z.
struct Coord {
  std::int32_t x = 0, y = 0, z = 0;

  friend constexpr auto operator<=>(const Coord&, const Coord&) = default;
  friend constexpr Coord operator+(Coord a, Coord b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Coord operator-(Coord a, Coord b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Coord operator*(Coord a, std::int32_t s) { return {a.x * s, a.y * s, a.z * s}; }
};

/// Componentwise minimum and maximum.
constexpr Coord minCoord(Coord a, Coord b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
constexpr Coord maxCoord(Coord a, Coord b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

/// The text "(x, y, z)", for messages.
inline std::string toString(Coord c) {
  return "(" + std::to_string(c.x) + ", " + std::to_string(c.y) + ", " + std::to_string(c.z) + ")";
}

/// A box of voxels that includes both corners. The default is an empty box.
struct Box {
  static constexpr std::int32_t kMax = std::numeric_limits<std::int32_t>::max();
  static constexpr std::int32_t kMin = std::numeric_limits<std::int32_t>::min();

  Coord min{kMax, kMax, kMax};
  Coord max{kMin, kMin, kMin};

  /// The box of all possible voxels.
  [[nodiscard]] static constexpr Box whole() { return {{kMin, kMin, kMin}, {kMax, kMax, kMax}}; }

  friend constexpr bool operator==(const Box&, const Box&) = default;
  [[nodiscard]] constexpr bool empty() const {
    return min.x > max.x || min.y > max.y || min.z > max.z;
  }
  [[nodiscard]] constexpr bool contains(Coord c) const {
    return c.x >= min.x && c.x <= max.x && c.y >= min.y && c.y <= max.y && c.z >= min.z &&
           c.z <= max.z;
  }
  constexpr void expand(Coord c) {
    min = minCoord(min, c);
    max = maxCoord(max, c);
  }
  constexpr void expand(const Box& b) {
    min = minCoord(min, b.min);
    max = maxCoord(max, b.max);
  }
  /// Number of voxels. It is a double because it may exceed 64 bits.
  [[nodiscard]] constexpr double volume() const {
    if (empty()) return 0.0;
    return (double(max.x) - min.x + 1) * (double(max.y) - min.y + 1) * (double(max.z) - min.z + 1);
  }
};

/// The intersection of two boxes.
[[nodiscard]] constexpr Box common(const Box& a, const Box& b) {
  return {maxCoord(a.min, b.min), minCoord(a.max, b.max)};
}

}  // namespace esvr
