// Properties of grids as Python has them: metadata, transforms and classes.

#include <pybind11/stl.h>

#include <cstring>

#include "esvr/error.h"
#include "esvr/grid.h"
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

}  // namespace esvr::python
