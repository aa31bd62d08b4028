#include "format/morton_order.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include "codec/morton.h"

namespace esvr::format {
namespace {

constexpr int kBitsPerAxis = 21;  // three of these make a 64-bit key
constexpr double kCellsPerVoxel = 256.0;
constexpr double kLastCell = double((1u << kBitsPerAxis) - 1);  // at 8192 voxels

/// Adds one coordinate to the keys of all ellipsoids. Cells are counted from the lowest center.
void addAxis(const std::vector<float>& center, int axis, std::vector<std::uint64_t>& keys) {
  if (center.empty()) return;
  const double low = *std::min_element(center.begin(), center.end());
  for (std::size_t i = 0; i < center.size(); ++i) {
    const double cell = std::min((center[i] - low) * kCellsPerVoxel, kLastCell);
    keys[i] |= spreadBits(std::uint64_t(cell)) << axis;
  }
}

std::vector<float> picked(const std::vector<float>& values, const std::vector<std::size_t>& order) {
  std::vector<float> result;
  if (values.empty()) return result;
  result.reserve(order.size());
  for (const auto i : order) result.push_back(values[i]);
  return result;
}

}  // namespace

Ellipsoids inMortonOrder(const Ellipsoids& e) {
  std::vector<std::uint64_t> keys(e.size());
  for (int axis = 0; axis < 3; ++axis) addAxis(e.center[std::size_t(axis)], axis, keys);
  std::vector<std::size_t> order(e.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return keys[a] < keys[b]; });

  Ellipsoids sorted;
  for (std::size_t c = 0; c < 3; ++c) sorted.center[c] = picked(e.center[c], order);
  for (std::size_t c = 0; c < 3; ++c) sorted.logScale[c] = picked(e.logScale[c], order);
  for (std::size_t c = 0; c < 4; ++c) sorted.rotation[c] = picked(e.rotation[c], order);
  sorted.intensity = picked(e.intensity, order);
  sorted.kappa = picked(e.kappa, order);
  return sorted;
}

}  // namespace esvr::format
