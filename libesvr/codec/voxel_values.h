#pragma once
/// The values that the codes of a voxel layer stand for (VoxelForm), and the codes of values.

#include <cstdint>
#include <span>

#include "esvr/quantised.h"

namespace esvr::codec {

/// The float and the half with a number in increasing order.
[[nodiscard]] float floatAt(std::int32_t n);
[[nodiscard]] float halfAt(std::int32_t n);

[[nodiscard]] std::int32_t orderOfFloat(float v);
/// The number of the half that is nearest to v among those of no larger magnitude. v is a half if
/// halfAt() of the result equals v.
[[nodiscard]] std::int32_t orderOfHalf(float v);
[[nodiscard]] bool inOrder(float a, float b);
/// The half that is nearest to v, ties to the even one. A value beyond 65504 becomes 65504 with its
/// sign, and a negative value that would become 0 becomes the negative half next to 0, so that
/// nothing leaves the halfs or changes its side of 0. NaN remains NaN.
[[nodiscard]] float nearestHalf(float v);

/// The value of a code of a layer. A code of the form kPalette must be in the palette.
[[nodiscard]] float valueOfCode(const VoxelLayer& layer, std::int32_t code);
/// The code of the value: the nearest one for kQuantised, and the exact one of values that the other
/// forms have.
[[nodiscard]] std::int32_t codeOfValue(const VoxelLayer& layer, float value);
/// The same for all voxels of a brick.
void valuesOfCodes(const VoxelLayer& layer, std::span<const std::int32_t> codes,
                   std::span<float> values);
void codesOfValues(const VoxelLayer& layer, std::span<const float> values,
                   std::span<std::int32_t> codes);

}  // namespace esvr::codec
