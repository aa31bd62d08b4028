// What repr() says of volumes, grids and files: shape, values, transform and bytes, in one line.

#include <cmath>
#include <cstdio>

#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

std::string numberText(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// "123 bytes", "1.5 MB": units of 1000, as the programs have them.
std::string bytesText(std::uint64_t bytes) {
  constexpr std::uint64_t kUnit = 1000;
  const char* units[] = {"KB", "MB", "GB", "TB"};
  if (bytes < kUnit) return std::to_string(bytes) + " bytes";
  double amount = double(bytes) / double(kUnit);
  std::size_t unit = 0;
  for (; amount >= double(kUnit) && unit < std::size(units) - 1; ++unit) amount /= double(kUnit);
  char text[32];
  std::snprintf(text, sizeof text, "%.3g %s", amount, units[unit]);
  return text;
}

/// "25 x 25 x 25 voxels from (-3, 100, 7)".
std::string shapeText(const Box& box) {
  if (box.empty()) return "no active voxel";
  const auto side = [](std::int32_t low, std::int32_t high) {
    return std::to_string(std::int64_t(high) - low + 1);
  };
  return side(box.min.x, box.max.x) + " x " + side(box.min.y, box.max.y) + " x " +
         side(box.min.z, box.max.z) + " voxels from " + toString(box.min);
}

std::string rangeText(float low, float high) {
  return "values " + numberText(low) + " to " + numberText(high);
}

/// "voxel size 0.5", or the sides of a voxel that is no cube, or of one that is turned or sheared.
std::string transformText(const Transform& transform) {
  if (!transform.affine) return "a frustum";
  const auto& m = *transform.affine;  // row-major, for row vectors
  std::array<double, 3> sides{};
  bool isTurned = false;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      sides[row] = std::hypot(sides[row], m[4 * row + column]);
      isTurned = isTurned || (row != column && m[4 * row + column] != 0.0);
    }
  }
  const std::string first = numberText(sides[0]), second = numberText(sides[1]),
                    third = numberText(sides[2]);
  const bool isCube = first == second && second == third;
  return "voxel size " + (isCube ? first : first + " x " + second + " x " + third) +
         (isTurned ? ", turned or sheared" : "");
}

std::string titleOf(const char* type, const GridDescriptor& grid) {
  return std::string("<esvr.") + type + " '" + shownName(grid.name) + "': " +
         (grid.gridClass == GridClass::kUnknown ? ""
                                                : std::string(className(grid.gridClass)) + ", ");
}

std::string activeText(std::uint64_t voxels) { return std::to_string(voxels) + " active"; }

/// The names with commas between them, of which very many are left out.
std::string listOf(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 20;
  std::string list;
  for (std::size_t n = 0; n < std::min(names.size(), kMost); ++n)
    list += (n == 0 ? "" : ", ") + shownName(names[n]);
  if (names.size() > kMost) list += " and " + std::to_string(names.size() - kMost) + " more";
  return list;
}

}  // namespace

std::uint64_t bytesInMemory(const SparseVolume& volume) {
  return volume.values.size() * sizeof(float) +
         volume.brickCount() * (sizeof(Coord) + sizeof(BrickMask));
}

std::string describe(const Volume& self) {
  const VolumeGrid& grid = *self.grid;
  const Box box = activeBox(grid.volume);
  std::string text = titleOf("Volume", grid.descriptor) + shapeText(box);
  if (!box.empty()) {
    const ValueRange range = activeRange(grid.volume);
    text +=
        ", " + activeText(activeVoxelCount(grid.volume)) + ", " + rangeText(range.min, range.max);
  }
  return text + ", " + transformText(grid.descriptor.transform) + ", " +
         bytesText(bytesInMemory(grid.volume)) + " of memory>";
}

std::string describe(const Grid& self) {
  const StoredGrid& grid = *self.grid;
  const std::size_t ellipsoids = grid.field.ellipsoidCount();
  std::string text = titleOf("Grid", grid.descriptor);
  text += grid.voxels ? "stored as voxels, " : std::to_string(ellipsoids) + " ellipsoids, ";
  text += shapeText(grid.activeBox) + ", " + activeText(grid.activeVoxels);
  if (!grid.activeBox.empty()) text += ", " + rangeText(grid.valueMin, grid.valueMax);
  return text + ", " + transformText(grid.descriptor.transform) + ", " +
         bytesText(bytesAdded(grid)) + " of a file>";
}

std::string describe(const Packed& self) {
  const PackedGrid& grid = *self.grid;
  const Box box = activeBox(grid);
  std::string text =
      titleOf("PackedGrid", grid.descriptor) + valueTypeOf(grid) + ", " + shapeText(box);
  if (!box.empty()) text += ", " + activeText(activeVoxelCount(grid));
  return text + ", " + transformText(grid.descriptor.transform) + ">";
}

std::string describe(const File& self) {
  const EsvrFile& file = *self.file;
  const std::vector<std::string> names = namesOfStored(file);
  std::string text =
      "<esvr.File: " + std::to_string(names.size()) + (names.size() == 1 ? " grid" : " grids");
  if (!names.empty()) text += " (" + listOf(names) + ")";
  std::vector<std::string> carried;
  for (const CarriedGrid& grid : file.carried) carried.push_back(grid.name);
  if (!carried.empty())
    text += ", " + std::to_string(carried.size()) + " carried unchanged (" + listOf(carried) + ")";
  return text + ", " + bytesText(contentBytes(file)) + " of memory>";
}

}  // namespace esvr::python
