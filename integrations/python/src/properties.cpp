// Properties of grids as Python has them: metadata, transforms, classes, and what repr() says of them.

#include <pybind11/stl.h>

#include <cmath>
#include <cstdio>
#include <cstring>

#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

// Metadata.

template <class T>
MetaItem itemOf(const std::string& name, const char* type, const T& value) {
  MetaItem item{name, type, std::vector<std::byte>(sizeof value)};
  std::memcpy(item.value.data(), &value, sizeof value);
  return item;
}

bool isInteger(const py::handle& value) { return PyIndex_Check(value.ptr()) != 0; }
bool isFloat(const py::handle& value) { return py::isinstance<py::float_>(value); }

/// True for a tuple of three objects of a kind.
template <class Test>
bool isTriple(const py::handle& value, const Test& test) {
  if (!py::isinstance<py::tuple>(value) || py::len(value) != 3) return false;
  for (const py::handle element : py::reinterpret_borrow<py::tuple>(value))
    if (!test(element)) return false;
  return true;
}

}  // namespace

/// OpenVDB has a type for each kind of value.
std::vector<MetaItem> itemsOf(const py::dict& metadata) {
  std::vector<MetaItem> items;
  for (const auto& [key, value] : metadata) {
    const auto name = key.cast<std::string>();
    if (py::isinstance<py::bool_>(value))
      items.push_back(itemOf(name, "bool", value.cast<bool>()));
    else if (isInteger(value))
      items.push_back(itemOf(name, "int64", value.cast<std::int64_t>()));
    else if (py::isinstance<py::float_>(value))
      items.push_back(itemOf(name, "double", value.cast<double>()));
    else if (py::isinstance<py::str>(value))
      items.push_back(stringItem(name, value.cast<std::string>()));
    else if (isTriple(value, isInteger))
      items.push_back(itemOf(name, "vec3i", value.cast<Corner>()));
    else if (isTriple(value, isFloat))
      items.push_back(itemOf(name, "vec3d", value.cast<std::array<double, 3>>()));
    else
      throw UsageError("the metadata item '" + name +
                       "' must be a text, a number, a truth value, or a tuple of three integers or "
                       "three floats");
  }
  return items;
}

namespace {

template <class T>
py::object valueAs(const MetaItem& item) {
  T value{};
  if (item.value.size() != sizeof value) return py::none();
  std::memcpy(&value, item.value.data(), sizeof value);
  return py::cast(value);
}

/// None for an item of a type that itemsOf does not make and that is no number.
py::object objectOf(const MetaItem& item) {
  const auto* const text = reinterpret_cast<const char*>(item.value.data());
  if (item.type == "string")
    return py::reinterpret_steal<py::object>(
        PyUnicode_DecodeUTF8(text, py::ssize_t(item.value.size()), "replace"));
  if (item.type == "bool")
    return item.value.size() == 1 ? py::object(py::bool_(text[0] != 0)) : py::none();
  if (item.type == "int32") return valueAs<std::int32_t>(item);
  if (item.type == "int64") return valueAs<std::int64_t>(item);
  if (item.type == "float") return valueAs<float>(item);
  if (item.type == "double") return valueAs<double>(item);
  if (item.type == "vec3i") return py::tuple(valueAs<Corner>(item));
  if (item.type == "vec3d") return py::tuple(valueAs<std::array<double, 3>>(item));
  return py::none();
}

}  // namespace

py::dict dictOf(const std::vector<MetaItem>& items) {
  py::dict metadata;
  for (const MetaItem& item : items)
    if (const py::object value = objectOf(item); !value.is_none())
      metadata[py::str(item.name)] = value;
  return metadata;
}

// Transforms and classes.

Transform transformFrom(const Matrix& matrix) {
  std::array<double, 16> rows{};
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t column = 0; column < 4; ++column) rows[4 * column + row] = matrix[row][column];
  return affineTransform(rows);
}

py::object matrixOf(const Transform& transform) {
  if (!transform.affine) return py::none();
  constexpr py::ssize_t kSide = 4;
  py::array_t<double> matrix({kSide, kSide});
  for (py::ssize_t row = 0; row < kSide; ++row)  // the library's matrix is for row vectors
    for (py::ssize_t column = 0; column < kSide; ++column)
      matrix.mutable_at(row, column) = (*transform.affine)[std::size_t(kSide * column + row)];
  return matrix;
}

GridClass classFrom(const std::string& name) {
  for (const auto gridClass : {GridClass::kUnknown, GridClass::kFogVolume})
    if (name == className(gridClass)) return gridClass;
  throw UsageError("grid_class is 'fog volume' or 'unknown', not '" + name + "'");
}

// What repr() says: shape, values, transform and bytes, in one line.

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
