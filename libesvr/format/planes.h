#pragma once
/// The ellipsoids' arrays as bytes of a section: one array behind the other.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace esvr::format {

using Plane = std::vector<float>;

[[nodiscard]] std::vector<std::byte> putPlanes(std::span<const Plane> planes);

/// Fills `planes` with `count` values each. \throws BadInput  the content has another size (checked
/// before anything is allocated); begins with `where`
void getPlanes(std::span<const std::byte> content, std::uint64_t count, std::span<Plane> planes,
               const std::string& where);

/// True where every quaternion is (1, 0, 0, 0), bit by bit: not worth a section.
[[nodiscard]] bool allIdentity(const std::array<Plane, 4>& rotation);
void setIdentity(std::array<Plane, 4>& rotation, std::size_t count);

}  // namespace esvr::format
