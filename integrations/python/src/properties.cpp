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

namespace {

/// OpenVDB has a type for each kind of value.
MetaItem itemFrom(const std::string& name, const py::handle& value) {
  if (py::isinstance<py::bool_>(value)) return itemOf(name, "bool", value.cast<bool>());
  if (isInteger(value)) return itemOf(name, "int64", value.cast<std::int64_t>());
  if (py::isinstance<py::float_>(value)) return itemOf(name, "double", value.cast<double>());
  if (py::isinstance<py::str>(value)) return stringItem(name, value.cast<std::string>());
  if (isTriple(value, isInteger)) return itemOf(name, "vec3i", value.cast<Corner>());
  if (isTriple(value, isFloat)) return itemOf(name, "vec3d", value.cast<std::array<double, 3>>());
  throw py::cast_error();
}

}  // namespace

std::vector<MetaItem> itemsOf(const py::dict& metadata) {
  std::vector<MetaItem> items;
  for (const auto& [key, value] : metadata) try {
      if (!py::isinstance<py::str>(key)) throw py::cast_error();
      items.push_back(itemFrom(key.cast<std::string>(), value));
    } catch (const py::cast_error&) {  // also for integers that are too large, and broken texts
      throw UsageError(
          "the metadata item " + py::repr(key).cast<std::string>() +
          " must be a text, a number (integers of 64 bits), a truth value, or a tuple of "
          "three integers of 32 bits or three floats, and its name a text");
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

// What repr() says: shape, values, transform and bytes, in one line for a grid.

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

/// "voxel size 0.5", or the sides of a voxel that is no cube, or of one that is turned or sheared, and where voxel
/// (0, 0, 0) is, if this is not the origin of the world.
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
  const auto joined = [](const double* numbers, const char* between) {
    return numberText(numbers[0]) + between + numberText(numbers[1]) + between +
           numberText(numbers[2]);
  };
  const std::string first = numberText(sides[0]);
  const bool isCube = first == numberText(sides[1]) && first == numberText(sides[2]);
  const double* const shift = &m[12];
  const bool isShifted = shift[0] != 0.0 || shift[1] != 0.0 || shift[2] != 0.0;
  return "voxel size " + (isCube ? first : joined(sides.data(), " x ")) +
         (isTurned ? ", turned or sheared" : "") +
         (isShifted ? ", voxel (0, 0, 0) at (" + joined(shift, ", ") + ")" : "");
}

/// "'density': fog volume, "
std::string titleOf(const std::string& name, const GridDescriptor& grid) {
  return "'" + shownName(name) + "': " +
         (grid.gridClass == GridClass::kUnknown ? ""
                                                : std::string(className(grid.gridClass)) + ", ");
}

std::string titleOf(const char* type, const GridDescriptor& grid) {
  return std::string("<esvr.") + type + " " + titleOf(grid.name, grid);
}

std::string activeText(std::uint64_t voxels) { return std::to_string(voxels) + " active"; }

/// Of more grids, the rest is a number.
constexpr std::size_t kMostListed = 20;

/// The names with commas between them.
std::string listOf(const std::vector<std::string>& names) {
  std::string list;
  for (std::size_t n = 0; n < std::min(names.size(), kMostListed); ++n)
    list += (n == 0 ? "" : ", ") + shownName(names[n]);
  if (names.size() > kMostListed)
    list += " and " + std::to_string(names.size() - kMostListed) + " more";
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

namespace {

/// Everything of a grid but its name and its bytes.
std::string contentText(const StoredGrid& grid) {
  std::string text = grid.voxels ? "stored as voxels, "
                                 : std::to_string(grid.field.ellipsoidCount()) + " ellipsoids, ";
  text += shapeText(grid.activeBox) + ", " + activeText(grid.activeVoxels);
  if (!grid.activeBox.empty()) text += ", " + rangeText(grid.valueMin, grid.valueMax);
  return text + ", " + transformText(grid.descriptor.transform);
}

}  // namespace

std::string describe(const Grid& self) {
  const StoredGrid& grid = *self.grid;
  return titleOf("Grid", grid.descriptor) + contentText(grid) + ", " + bytesText(bytesAdded(grid)) +
         " of a file>";
}

std::string describe(const Packed& self) {
  const PackedGrid& grid = *self.grid;
  const Box box = activeBox(grid);
  std::string text =
      titleOf("PackedGrid", grid.descriptor) + valueTypeOf(grid) + ", " + shapeText(box);
  if (!box.empty()) text += ", " + activeText(activeVoxelCount(grid));
  return text + ", " + transformText(grid.descriptor.transform) + ">";
}

/// One line for one grid, and a line for each of several, of which very many are left out.
std::string describe(const File& self) {
  const EsvrFile& file = *self.file;
  const std::vector<std::string> names = namesOfStored(file);
  std::vector<std::string> carried;
  for (const CarriedGrid& grid : file.carried) carried.push_back(grid.name);
  std::string text =
      "<esvr.File: " + std::to_string(names.size()) + (names.size() == 1 ? " grid" : " grids");
  if (!carried.empty())
    text += ", " + std::to_string(carried.size()) + " carried unchanged (" + listOf(carried) + ")";
  text += ", " + bytesText(contentBytes(file)) + " of memory";
  for (std::size_t g = 0; g < std::min(names.size(), kMostListed); ++g)
    text += (names.size() == 1 ? ": " : "\n  ") + titleOf(names[g], file.grids[g].descriptor) +
            contentText(file.grids[g]);
  if (names.size() > kMostListed)
    text += "\n  and " + std::to_string(names.size() - kMostListed) + " more";
  return text + ">";
}

}  // namespace esvr::python
