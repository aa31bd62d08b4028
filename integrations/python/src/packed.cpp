// esvr.GridBuilder and esvr.PackedGrid: grids of all types that images need, made and read slab by slab.

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <cstring>
#include <map>

#include "esvr/error.h"
#include "esvr/grid_names.h"
#include "esvr/packed_grid.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

/// esvr.PackedGrid. It does not change after it was made.
struct Packed {
  std::shared_ptr<const PackedGrid> grid;
};

template <class T>
T valueIn(const MetaItem& item) {
  T value{};
  std::memcpy(&value, item.value.data(), std::min(sizeof value, item.value.size()));
  return value;
}

template <class T>
MetaItem itemOf(const std::string& name, const char* type, const T& value) {
  MetaItem item{name, type, std::vector<std::byte>(sizeof value)};
  std::memcpy(item.value.data(), &value, sizeof value);
  return item;
}

/// A text, a number, a truth value or three whole numbers as an item of metadata.
MetaItem itemFrom(const std::string& name, const py::handle& value) {
  if (py::isinstance<py::bool_>(value)) return itemOf(name, "bool", value.cast<bool>());
  if (py::isinstance<py::int_>(value)) return itemOf(name, "int64", value.cast<std::int64_t>());
  if (py::isinstance<py::float_>(value)) return itemOf(name, "double", value.cast<double>());
  if (py::isinstance<py::str>(value)) return stringItem(name, value.cast<std::string>());
  if (py::isinstance<py::tuple>(value)) return itemOf(name, "vec3i", value.cast<Corner>());
  throw UsageError("the metadata item '" + name +
                   "' must be a text, a number, a truth value or a tuple of three integers");
}

/// None for an item of a type that itemFrom does not make and that no number is.
py::object valueOf(const MetaItem& item) {
  if (item.type == "string")
    return py::reinterpret_steal<py::object>(
        PyUnicode_DecodeUTF8(reinterpret_cast<const char*>(item.value.data()),
                             py::ssize_t(item.value.size()), "replace"));
  if (item.type == "bool") return py::bool_(valueIn<bool>(item));
  if (item.type == "int32") return py::int_(valueIn<std::int32_t>(item));
  if (item.type == "int64") return py::int_(valueIn<std::int64_t>(item));
  if (item.type == "float") return py::float_(valueIn<float>(item));
  if (item.type == "double") return py::float_(valueIn<double>(item));
  if (item.type == "vec3i") return py::tuple(py::cast(valueIn<Corner>(item)));
  return py::none();
}

std::vector<MetaItem> itemsOf(const py::dict& metadata) {
  std::vector<MetaItem> items;
  for (const auto& [name, value] : metadata)
    items.push_back(itemFrom(name.cast<std::string>(), value));
  return items;
}

py::dict dictOf(const std::vector<MetaItem>& items) {
  py::dict metadata;
  for (const MetaItem& item : items)
    if (const py::object value = valueOf(item); !value.is_none())
      metadata[py::str(item.name)] = value;
  return metadata;
}

using Matrix = std::array<std::array<double, 4>, 4>;

/// \param matrix  for column vectors; the library's is for row vectors
Transform transformFrom(const Matrix& matrix) {
  std::array<double, 16> rows{};
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t column = 0; column < 4; ++column) rows[4 * column + row] = matrix[row][column];
  return affineTransform(rows);
}

template <class Source>
using Parts = std::vector<ImageBox<Source>>;

/// The strides of three axes, in elements. \throws UsageError  the elements are not aligned
template <class T>
std::array<std::ptrdiff_t, 3> stridesOf(const py::array& array) {
  std::array<std::ptrdiff_t, 3> strides{};
  for (int a = 0; a < 3; ++a) {
    if (array.strides(a) % py::ssize_t(sizeof(T)) != 0)
      throw UsageError("the elements of the array are not aligned");
    strides[std::size_t(a)] = array.strides(a) / py::ssize_t(sizeof(T));
  }
  return strides;
}

Coord sizeOf(const py::array& array) {
  for (int a = 0; a < 3; ++a)
    if (array.shape(a) > Box::kMax) throw UsageError("an axis of the array is too long");
  return {std::int32_t(array.shape(0)), std::int32_t(array.shape(1)), std::int32_t(array.shape(2))};
}

/// The boxes of an array: one, or one for each component on its fourth axis.
template <class Source>
Parts<Source> partsOf(const py::array& array, const Corner& origin,
                      const std::optional<py::array_t<bool>>& active) {
  const auto* voxels = static_cast<const Source*>(array.data());
  ImageBox<Source> box{voxels, stridesOf<Source>(array), coordOf(origin), sizeOf(array)};
  if (active) {
    box.active = active->data();
    box.activeStrides = stridesOf<bool>(*active);
  }
  Parts<Source> parts{box};
  for (py::ssize_t c = 1; array.ndim() == 4 && c < array.shape(3); ++c) {
    parts.push_back(box);
    parts.back().voxels = voxels + c * (array.strides(3) / py::ssize_t(sizeof(Source)));
  }
  return parts;
}

/// esvr.GridBuilder.
class Builder {
 public:
  virtual ~Builder() = default;
  virtual void add(const py::array& array, const Corner& origin,
                   const std::optional<py::array_t<bool>>& active) = 0;
  virtual AnyPackedVoxels finish() = 0;

  GridDescriptor descriptor;
};

template <class T, class... Sources>
class TypedBuilder : public Builder {
 public:
  TypedBuilder(T background, const PackingRule& rule) : packer_(background, rule) {}

  void add(const py::array& array, const Corner& origin,
           const std::optional<py::array_t<bool>>& active) override {
    const py::ssize_t axes = std::is_same_v<T, PackedVector> ? 4 : 3;
    if (array.ndim() != axes || (axes == 4 && array.shape(3) != py::ssize_t(kComponents)))
      throw UsageError(axes == 4 ? "vectors have the axes x, y, z and three components"
                                 : "the array must have the axes x, y, z");
    for (int a = 0; active && a < 3; ++a)
      if (active->ndim() != 3 || active->shape(a) != array.shape(a))
        throw UsageError("the mask of active voxels has another size than the array");
    if (!(addAs<Sources>(array, origin, active) || ...))
      throw UsageError("a grid of this type takes no array of " +
                       py::str(array.dtype()).cast<std::string>());
  }

  AnyPackedVoxels finish() override { return packer_.finish(); }

 private:
  template <class Source>
  bool addAs(const py::array& array, const Corner& origin,
             const std::optional<py::array_t<bool>>& active) {
    if (!py::isinstance<py::array_t<Source>>(array)) return false;
    const auto parts = partsOf<Source>(array, origin, active);
    const py::gil_scoped_release release;
    if (array.size() > 0) packer_.template add<Source>(parts);
    return true;
  }

  GridPacker<T> packer_;
};

using NumberBuilder = TypedBuilder<float, std::int8_t, std::uint8_t, std::int16_t, std::uint16_t,
                                   std::int32_t, std::uint32_t, float, double>;

std::unique_ptr<Builder> makeBuilder(const std::string& type, double background,
                                     const PackingRule& rule) {
  constexpr double kLargestInt32 = 2147483647.0, kExact = 9007199254740992.0;  // 2^53
  const auto whole = [&](double largest) {
    if (background != std::floor(background) || std::abs(background) > largest)
      throw UsageError("background must be a whole number that the type of the grid holds");
    return std::int64_t(background);
  };
  if (!std::isfinite(background)) throw UsageError("background must be finite");
  if (type == "float") return std::make_unique<NumberBuilder>(float(background), rule);
  if (type == "int32")
    return std::make_unique<TypedBuilder<std::int32_t, std::int64_t>>(
        std::int32_t(whole(kLargestInt32)), rule);
  if (type == "int64")
    return std::make_unique<TypedBuilder<std::int64_t, std::int64_t>>(whole(kExact), rule);
  if (type == "bool") return std::make_unique<TypedBuilder<bool, bool>>(false, rule);
  if (type == "vec3s") {
    const auto b = float(background);
    return std::make_unique<TypedBuilder<PackedVector, float>>(PackedVector{b, b, b}, rule);
  }
  throw UsageError("type is one of float, int32, int64, bool, vec3s, not '" + type + "'");
}

GridClass classFrom(const std::string& name) {
  for (const auto gridClass : {GridClass::kUnknown, GridClass::kFogVolume})
    if (name == className(gridClass)) return gridClass;
  throw UsageError("grid_class is 'fog volume' or 'unknown', not '" + name + "'");
}

/// The type of NumPy that holds a value of a grid.
template <class T>
using Element = std::conditional_t<std::is_same_v<T, PackedVector>, float, T>;

/// The voxels of a box as an array; a fourth axis has the components of vectors.
template <class T>
py::array_t<Element<T>> arrayOf(const PackedVoxels<T>& voxels, const Box& box) {
  constexpr std::size_t kNumbers = sizeof(T) / sizeof(Element<T>);
  const auto side = [](std::int32_t low, std::int32_t high) { return py::ssize_t(high) - low + 1; };
  std::vector<py::ssize_t> shape{side(box.min.x, box.max.x), side(box.min.y, box.max.y),
                                 side(box.min.z, box.max.z)};
  if (kNumbers > 1) shape.push_back(kNumbers);
  py::array_t<Element<T>> array(shape);
  T* values = reinterpret_cast<T*>(array.mutable_data());
  const py::ssize_t ny = shape[1], nz = shape[2];
  const py::gil_scoped_release release;
  std::fill(values, values + shape[0] * ny * nz, voxels.background);
  for (std::size_t b = 0; b < voxels.bricks.size(); ++b) {
    const PackedBrick& brick = voxels.bricks[b];
    const Box reach{brick.corner,
                    brick.corner + Coord{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1}};
    if (common(reach, box).empty()) continue;
    int n = 0;
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (!brick.active.test(i)) continue;
      const Coord voxel = brick.corner + voxelLocal(i);
      const Coord v = voxel - box.min;
      if (box.contains(voxel)) values[(v.x * ny + v.y) * nz + v.z] = voxels.value(b, n);
      ++n;
    }
  }
  return array;
}

Box boxOrActive(const PackedGrid& grid, const std::optional<PlainBox>& box) {
  const Box chosen = box ? boxOf(*box) : activeBox(grid);
  if (chosen.empty())
    throw UsageError(box ? "the box is empty" : "the grid has no active voxel; name a box");
  return chosen;
}

py::array packedToNumpy(const Packed& self, const std::optional<PlainBox>& box) {
  const Box chosen = boxOrActive(*self.grid, box);
  return std::visit([&](const auto& voxels) -> py::array { return arrayOf(voxels, chosen); },
                    self.grid->voxels);
}

/// The active voxels of a box, which are the voxels of a mask.
py::array activeOf(const Packed& self, const std::optional<PlainBox>& box) {
  const auto bricks = bricksOf(*self.grid);
  return arrayOf(PackedVoxels<bool>{false, {bricks.begin(), bricks.end()}, {}},
                 boxOrActive(*self.grid, box));
}

py::object backgroundOf(const PackedGrid& grid) {
  return std::visit([](const auto& voxels) { return py::cast(voxels.background); }, grid.voxels);
}

Volume toVolume(const Packed& self) {
  const auto* voxels = std::get_if<PackedVoxels<float>>(&self.grid->voxels);
  if (!voxels)
    throw UsageError("grid '" + self.grid->descriptor.name + "' holds " + valueTypeOf(*self.grid) +
                     ", and a volume holds float");
  const py::gil_scoped_release release;
  GridDescriptor descriptor = self.grid->descriptor;
  descriptor.valueType = ValueType::kFloat;
  descriptor.background = double(voxels->background);
  return {std::make_shared<VolumeGrid>(VolumeGrid{std::move(descriptor), unpacked(*voxels)})};
}

Packed finishBuilder(Builder& builder) {
  const py::gil_scoped_release release;
  return {std::make_shared<PackedGrid>(PackedGrid{builder.descriptor, builder.finish()})};
}

Packed packedFromVdb(const std::filesystem::path& path, const std::string& name) {
  const py::gil_scoped_release release;
  return {std::make_shared<PackedGrid>(readPacked(path, name))};
}

void writeVdb(const std::filesystem::path& path, const std::vector<Packed>& grids,
              const py::dict& metadata, bool overwrite) {
  const auto items = itemsOf(metadata);
  std::vector<GridToWrite> all;
  std::vector<Volume> volumes;  // NanoVDB's writer takes them only
  for (const Packed& grid : grids) {
    if (path.extension() == ".nvdb") volumes.push_back(toVolume(grid));
    all.emplace_back(grid.grid.get());
  }
  for (std::size_t g = 0; g < volumes.size(); ++g) all[g] = volumes[g].grid.get();
  const py::gil_scoped_release release;
  writeGrids(path, items, all, {.overwrite = overwrite});
}

std::vector<std::pair<std::string, std::string>> namesAndTypes(const std::filesystem::path& path) {
  const py::gil_scoped_release release;
  std::vector<std::pair<std::string, std::string>> names;
  for (const GridSummary& grid : inspectVdb(path).grids)
    names.emplace_back(grid.uniqueName, grid.valueType);
  return names;
}

void addBuilder(py::module_& module) {
  py::class_<Builder>(module, "GridBuilder",
                      "Makes a grid of an array that is given slab by slab. Only active voxels are "
                      "kept.")
      .def(py::init([](const std::string& type, const std::string& name, double background,
                       std::optional<double> threshold, const std::string& gridClass,
                       const std::optional<Matrix>& transform, const py::dict& metadata,
                       std::uint64_t maxBytes) {
             auto builder = makeBuilder(type, background, {threshold, maxBytes});
             builder->descriptor.name = name;
             builder->descriptor.gridClass = classFrom(gridClass);
             builder->descriptor.transform =
                 transform ? transformFrom(*transform) : uniformTransform(1.0);
             builder->descriptor.metadata = itemsOf(metadata);
             return builder;
           }),
           py::arg("type") = "float", py::kw_only(), py::arg("name") = "density",
           py::arg("background") = 0.0, py::arg("threshold") = py::none(),
           py::arg("grid_class") = "unknown", py::arg("transform") = py::none(),
           py::arg("metadata") = py::dict(), py::arg("max_bytes") = std::uint64_t{16} << 30,
           "type is 'float', 'int32', 'int64', 'bool' or 'vec3s'. transform is the 4 x 4 matrix\n"
           "from index to world coordinates, for column vectors. metadata has texts, numbers,\n"
           "truth values and tuples of three integers.")
      .def(
          "add",
          [](Builder& b, const py::array& array, const Corner& origin,
             const std::optional<py::array_t<bool>>& active) { b.add(array, origin, active); },
          py::arg("array"), py::arg("origin") = Corner{}, py::arg("active") = py::none(),
          "Adds an array with the axes x, y, z (and components), in any order in memory.\n\n"
          "origin is the voxel of array[0, 0, 0] and has multiples of 8. Where active (bool, of\n"
          "the same axes) is not given, a voxel is active if it is not below the threshold, or,\n"
          "without one, if it differs from the background. Arrays of 8 to 32 bits, float32 and\n"
          "float64 become floats; integer grids take int64, masks bool, and vectors float32.")
      .def("finish", &finishBuilder, "The grid (esvr.PackedGrid). The builder is empty afterwards.");
}

}  // namespace

void addPacked(py::module_& module) {
  addBuilder(module);
  py::class_<Packed>(module, "PackedGrid",
                     "The active voxels of a grid of floats, integers, truth values or vectors.")
      .def_static("from_vdb", &packedFromVdb, py::arg("path"), py::arg("grid"),
                  "Reads a grid of a .vdb file. Of a mask, the true voxels are active.")
      .def("to_numpy", &packedToNumpy, py::arg("box") = py::none(),
           "The voxels of a box ((x0, y0, z0), (x1, y1, z1)), both inclusive, with the axes x, y, "
           "z\n"
           "(and components); by default those of PackedGrid.box.")
      .def("active", &activeOf, py::arg("box") = py::none(),
           "Which voxels of a box are active: bool with the axes x, y, z.")
      .def("to_volume", &toVolume, "A volume with the voxels of a grid of floats.")
      .def_property_readonly("name", [](const Packed& p) { return p.grid->descriptor.name; })
      .def_property_readonly(
          "value_type", [](const Packed& p) { return valueTypeOf(*p.grid); },
          "\"float\", \"int32\", \"int64\", \"bool\" or \"vec3s\".")
      .def_property_readonly(
          "grid_class", [](const Packed& p) { return className(p.grid->descriptor.gridClass); },
          "\"fog volume\", \"level set\", \"staggered\" or \"unknown\".")
      .def_property_readonly("background", [](const Packed& p) { return backgroundOf(*p.grid); })
      .def_property_readonly(
          "active_voxels", [](const Packed& p) { return activeVoxelCount(*p.grid); },
          "Number of active voxels.")
      .def_property_readonly(
          "box", [](const Packed& p) { return plainBox(activeBox(*p.grid)); },
          "The first and the last active voxel along each axis; None if there is none.")
      .def_property_readonly(
          "transform", [](const Packed& p) { return matrixOf(p.grid->descriptor.transform); },
          "4 x 4 matrix from index to world coordinates, for column vectors; None for a frustum.")
      .def_property_readonly(
          "metadata", [](const Packed& p) { return dictOf(p.grid->descriptor.metadata); },
          "The grid's metadata that are texts, numbers, truth values or three integers.");
  module.def(
      "write_vdb", &writeVdb, py::arg("path"), py::arg("grids"), py::kw_only(),
      py::arg("metadata") = py::dict(), py::arg("overwrite") = false,
      "Writes packed grids to a .vdb file, or grids of floats to a .nvdb file. metadata are\n"
      "those of the file.");
  module.def("vdb_grids", &namesAndTypes, py::arg("path"),
             "The names and the types of the grids of a .vdb or .nvdb file, in their order.");
}

}  // namespace esvr::python
