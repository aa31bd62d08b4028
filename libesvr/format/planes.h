#pragma once
/// The arrays of ellipsoids as the content of sections: one array after the other.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace esvr::format {

using Plane = std::vector<float>;

[[nodiscard]] std::vector<std::byte> putPlanes(std::span<const Plane> planes);

/// Fills each of `planes` with `count` values.
/// \throws BadInput  the content has another size, which is checked before memory is allocated; the
///                   text begins with `where`
void getPlanes(std::span<const std::byte> content, std::uint64_t count, std::span<Plane> planes,
               const std::string& where);

/// True if every quaternion is (1, 0, 0, 0), bit by bit; the section of rotations is then left out.
[[nodiscard]] bool allIdentity(const std::array<Plane, 4>& rotation);
void setIdentity(std::array<Plane, 4>& rotation, std::size_t count);

}  // namespace esvr::format
