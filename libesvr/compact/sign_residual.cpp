#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "compact/residual_layer.h"
#include "esvr/residual.h"

namespace esvr {
namespace {

using compact::BrickCodes;

/// Steps of the residual's lattice in the half width of a band, which is usually 3 voxels. A voxel
/// that is corrected then has an error of at most a twentieth of a voxel.
constexpr double kStepsOfHalfWidth = 64.0;
/// Margins that a step has at least, so that every voxel has a code.
constexpr double kMarginsOfStep = 8.0;

/// True if a value has the wanted sign on every machine.
bool hasSign(double value, bool inside, double margin) {
  return inside ? value < -margin : value >= margin;
}

/// The code that brings a voxel nearest to its value in the source with the sign of the source; 0 if
/// the sum has this sign.
std::int32_t codeFor(float wanted, float sum, double step, double margin) {
  const bool inside = wanted < 0.0f;
  if (hasSign(sum, inside, margin)) return 0;
  auto code = std::int32_t(std::lround((double(wanted) - sum) / step));
  // The margin counts twice, which leaves room for the rounding of the value to float32.
  while (!hasSign(double(sum) + code * step, inside, 2.0 * margin)) code += inside ? -1 : 1;
  return code;
}

BrickCodes codesOf(std::span<const float> wanted, std::span<const float> sum, double step,
                   double margin) {
  BrickCodes brick;
  for (std::size_t v = 0; v < kBrickVoxels; ++v)
    brick.codes[v] = codeFor(wanted[v], sum[v], step, margin);
  return brick;
}

bool isEmpty(const BrickCodes& brick) {
  return std::all_of(brick.codes.begin(), brick.codes.end(), [](auto code) { return code == 0; });
}

}  // namespace

StoredGrid withSigns(StoredGrid grid, const SparseVolume& source) {
  const auto margins = compact::marginsOf(grid.field, grid.bricks);
  const double margin = margins.empty() ? 0.0 : *std::max_element(margins.begin(), margins.end());
  const double step =
      std::max(double(source.background) / kStepsOfHalfWidth, kMarginsOfStep * margin);
  const SparseVolume sum = compact::sumIn(grid, grid.bricks);
  std::vector<BrickCodes> bricks;
  for (std::size_t b = 0; b < source.brickCount(); ++b) {
    BrickCodes brick = codesOf(source.brickValues(b), sum.brickValues(b), step, margins[b]);
    brick.corner = source.brickCorner(b);
    if (!isEmpty(brick)) bricks.push_back(brick);
  }
  if (!bricks.empty()) grid.residual = compact::layerOf(bricks, 1.0 / step);
  return grid;
}

}  // namespace esvr
