#include "format/planes.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "esvr/error.h"
#include "format/byte_writer.h"

namespace esvr::format {
namespace {

constexpr std::array<float, 4> kIdentity{1.0f, 0.0f, 0.0f, 0.0f};

/// Compares bits, so that negative zero is stored as such and not taken for zero.
bool sameBits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

}  // namespace

std::vector<std::byte> putPlanes(std::span<const Plane> planes) {
  ByteWriter out;
  for (const auto& plane : planes) out.putAll(plane);
  return out.take();
}

void getPlanes(std::span<const std::byte> content, std::uint64_t count, std::span<Plane> planes,
               const std::string& where) {
  const std::uint64_t perEllipsoid = planes.size() * sizeof(float);
  if (content.size() % perEllipsoid != 0 || content.size() / perEllipsoid != count)
    throw BadInput(where + ": " + std::to_string(content.size()) + " bytes of content for " +
                   std::to_string(count) + " ellipsoids");
  for (auto& plane : planes) {
    plane.resize(count);
    if (count != 0) std::memcpy(plane.data(), content.data(), count * sizeof(float));
    content = content.subspan(count * sizeof(float));
  }
}

bool allIdentity(const std::array<Plane, 4>& rotation) {
  for (std::size_t c = 0; c < rotation.size(); ++c) {
    const auto differs = [c](float q) { return !sameBits(q, kIdentity[c]); };
    if (std::any_of(rotation[c].begin(), rotation[c].end(), differs)) return false;
  }
  return true;
}

void setIdentity(std::array<Plane, 4>& rotation, std::size_t count) {
  for (std::size_t c = 0; c < rotation.size(); ++c) rotation[c].assign(count, kIdentity[c]);
}

}  // namespace esvr::format
