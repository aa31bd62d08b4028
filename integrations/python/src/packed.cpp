// esvr.GridBuilder and esvr.PackedGrid: grids of all types that images need, made and read slab by slab.

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "esvr/did_you_mean.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "esvr/sequence_file.h"
#include "esvr/volume.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

// -- making grids --------------------------------------------------------------------------------

/// The strides of the axes of space, in elements.
/// \throws UsageError  the elements are not aligned, or their bytes have another order
template <class T>
std::array<std::ptrdiff_t, 3> stridesOf(const py::array& array) {
  std::array<std::ptrdiff_t, 3> strides{};
  for (int a = 0; a < 3; ++a) {
    if (array.strides(a) % py::ssize_t(sizeof(T)) != 0)
      throw UsageError("the elements of the array are not aligned");
    strides[std::size_t(a)] = array.strides(a) / py::ssize_t(sizeof(T));
  }
  if (reinterpret_cast<std::uintptr_t>(array.data()) % alignof(T) != 0)
    throw UsageError("the elements of the array are not aligned");
  return strides;
}

/// The boxes of an array: one, or one for each component on its fourth axis.
template <class Source>
std::vector<ImageBox<Source>> boxesOf(const py::array& array, const Corner& origin,
                                      const std::optional<py::array>& active) {
  const auto* const voxels = static_cast<const Source*>(array.data());
  const Coord size{std::int32_t(array.shape(0)), std::int32_t(array.shape(1)),
                   std::int32_t(array.shape(2))};
  ImageBox<Source> box{voxels, stridesOf<Source>(array), coordOf(origin), size};
  if (active) {
    box.active = static_cast<const bool*>(active->data());
    box.activeStrides = stridesOf<bool>(*active);
  }
  std::vector<ImageBox<Source>> boxes{box};
  for (py::ssize_t c = 1; array.ndim() == 4 && c < array.shape(3); ++c) {
    boxes.push_back(box);
    boxes.back().voxels = voxels + c * (array.strides(3) / py::ssize_t(sizeof(Source)));
  }
  return boxes;
}

/// esvr.GridBuilder.
class Builder {
 public:
  virtual ~Builder() = default;
  virtual void add(const py::array& array, const Corner& origin,
                   const std::optional<py::array>& active) = 0;
  virtual AnyPackedVoxels finish() = 0;

  GridDescriptor descriptor;
};

/// \tparam Sources  the types that the elements of arrays may have
template <class T, class... Sources>
class TypedBuilder : public Builder {
 public:
  TypedBuilder(T background, const PackingRule& rule) : packer_(background, rule) {}

  void add(const py::array& array, const Corner& origin,
           const std::optional<py::array>& active) override {
    const py::ssize_t axes = std::is_same_v<T, PackedVector> ? 4 : 3;
    if (array.ndim() != axes || (axes == 4 && array.shape(3) != py::ssize_t(kComponents)))
      throw UsageError(axes == 4 ? "vectors have the axes x, y, z and three components"
                                 : "the array must have the axes x, y, z");
    for (int a = 0; a < 3; ++a) {
      if (array.shape(a) > Box::kMax) throw UsageError("an axis of the array is too long");
      if (active && (active->ndim() != 3 || active->shape(a) != array.shape(a)))
        throw UsageError("the mask of active voxels has another size than the array");
    }
    if (active && !py::isinstance<py::array_t<bool>>(*active))
      throw UsageError("the mask of active voxels must have elements of type bool");
    if (!(addAs<Sources>(array, origin, active) || ...))
      throw UsageError("a grid of this type takes no array of " +
                       py::str(array.dtype()).cast<std::string>() +
                       "; array.astype says what its values become");
  }

  AnyPackedVoxels finish() override { return packer_.finish(); }

 private:
  template <class Source>
  bool addAs(const py::array& array, const Corner& origin, const std::optional<py::array>& active) {
    if (!py::isinstance<py::array_t<Source>>(array)) return false;
    if (array.size() == 0) return true;
    const auto boxes = boxesOf<Source>(array, origin, active);
    interruptible([&] { packer_.template add<Source>(boxes); });
    return true;
  }

  GridPacker<T> packer_;
};

using std::int16_t, std::int32_t, std::int64_t, std::int8_t, std::uint16_t, std::uint32_t,
    std::uint8_t;
using FloatBuilder = TypedBuilder<float, int8_t, uint8_t, int16_t, uint16_t, float>;
using DoubleBuilder =
    TypedBuilder<double, int8_t, uint8_t, int16_t, uint16_t, int32_t, uint32_t, float, double>;
using Int32Builder = TypedBuilder<int32_t, int8_t, uint8_t, int16_t, uint16_t, int32_t>;
using Int64Builder =
    TypedBuilder<int64_t, int8_t, uint8_t, int16_t, uint16_t, int32_t, uint32_t, int64_t>;

double numberOf(const py::object& background) try {
  return background.cast<double>();
} catch (const py::cast_error&) {
  throw UsageError("background must be a number, not " + py::repr(background).cast<std::string>());
}

template <class T>
T wholeBackground(const py::object& background) {
  try {
    return py::int_(background.attr("__index__")()).cast<T>();
  } catch (const std::exception&) {
    if (const double value = numberOf(background);
        value == std::floor(value) && std::abs(value) < double(std::numeric_limits<T>::max()))
      return T(value);
    throw UsageError("background must be a whole number that the type of the grid holds");
  }
}

std::unique_ptr<Builder> makeBuilder(const std::string& type, const py::object& background,
                                     const PackingRule& rule) {
  if (rule.threshold && std::isnan(*rule.threshold)) throw UsageError("threshold must be a number");
  if (type == "int32")
    return std::make_unique<Int32Builder>(wholeBackground<int32_t>(background), rule);
  if (type == "int64")
    return std::make_unique<Int64Builder>(wholeBackground<int64_t>(background), rule);
  if (type == "bool") return std::make_unique<TypedBuilder<bool, bool>>(false, rule);
  const double number = numberOf(background);
  if (!std::isfinite(type == "double" ? number : double(float(number))))
    throw UsageError("background must be finite");
  if (type == "float") return std::make_unique<FloatBuilder>(float(number), rule);
  if (type == "double") return std::make_unique<DoubleBuilder>(number, rule);
  if (type == "vec3s") {
    if (rule.threshold) throw UsageError("vectors have no threshold; say which are active");
    const PackedVector vector{float(number), float(number), float(number)};
    return std::make_unique<TypedBuilder<PackedVector, float>>(vector, rule);
  }
  const std::vector<std::string> known{"float", "double", "int32", "int64", "bool", "vec3s"};
  throw UsageError("type is one of float, double, int32, int64, bool, vec3s, not '" + type + "'" +
                   didYouMean(type, known));
}

Packed finishBuilder(Builder& builder) {
  return interruptible([&] {
    return Packed{std::make_shared<PackedGrid>(PackedGrid{builder.descriptor, builder.finish()})};
  });
}

// -- arrays of grids -----------------------------------------------------------------------------

/// The type of NumPy that holds a value of a grid.
template <class T>
using Element = std::conditional_t<std::is_same_v<T, PackedVector>, float, T>;

/// An array for the voxels of a box, and the distances between its voxels.
template <class T>
class BoxArray {
 public:
  /// \param xFastest  x is the fastest axis in memory, else z
  BoxArray(const Box& box, bool xFastest) : box_(box) {
    requireAddressable(box, sizeof(T));
    const std::array<py::ssize_t, 3> sides{side(box.min.x, box.max.x), side(box.min.y, box.max.y),
                                           side(box.min.z, box.max.z)};
    std::vector<py::ssize_t> shape(sides.begin(), sides.end()), bytes(3);
    py::ssize_t step = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t axis = xFastest ? i : 2 - i;
      steps_[axis] = step;
      bytes[axis] = step * py::ssize_t(sizeof(T));
      step *= sides[axis];
    }
    count_ = step;
    if constexpr (std::is_same_v<T, PackedVector>) {
      shape.push_back(py::ssize_t(kComponents));
      bytes.push_back(py::ssize_t(sizeof(float)));
    }
    array_ = py::array_t<Element<T>>(shape, bytes);
    values_ = reinterpret_cast<T*>(array_.mutable_data());
  }

  void fill(const T& value) { std::fill(values_, values_ + count_, value); }
  [[nodiscard]] const Box& box() const { return box_; }
  [[nodiscard]] T& at(Coord voxel) {
    const Coord v = voxel - box_.min;
    return values_[v.x * steps_[0] + v.y * steps_[1] + v.z * steps_[2]];
  }
  [[nodiscard]] py::array array() const { return array_; }

 private:
  static py::ssize_t side(int32_t low, int32_t high) { return py::ssize_t(high) - low + 1; }

  Box box_;
  std::array<py::ssize_t, 3> steps_{};
  py::ssize_t count_ = 0;
  py::array_t<Element<T>> array_;
  T* values_ = nullptr;
};

Box reachOf(Coord corner) {
  return {corner, corner + Coord{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1}};
}

template <class T>
void fillActive(const PackedVoxels<T>& voxels, BoxArray<T>& to) {
  to.fill(voxels.background);
  const Box& box = to.box();
  // Bricks are ordered by x first.
  const auto from = std::ranges::lower_bound(
      voxels.bricks, Coord{box.min.x - kBrickSide + 1, Box::kMin, Box::kMin}, {},
      &PackedBrick::corner);
  const auto end = std::ranges::upper_bound(voxels.bricks, Coord{box.max.x, Box::kMax, Box::kMax},
                                            {}, &PackedBrick::corner);
  const auto first = std::size_t(from - voxels.bricks.begin());
  tbb::parallel_for(first, std::max(first, std::size_t(end - voxels.bricks.begin())),
                    [&](std::size_t b) {
                      const PackedBrick& brick = voxels.bricks[b];
                      if (common(reachOf(brick.corner), box).empty()) return;
                      forEachActive(brick.active, [&, n = 0](int i) mutable {
                        const Coord voxel = brick.corner + voxelLocal(i);
                        if (box.contains(voxel)) to.at(voxel) = voxels.value(b, n);
                        ++n;
                      });
                    });
}

/// Fills an array with the voxels of a level set. Inside the surface, inactive ones are negative.
void fillSigned(const SignedVoxels& levelSet, BoxArray<float>& to) {
  const SparseVolume& volume = levelSet.volume;
  const Coord first = brickOf(to.box().min), last = brickOf(to.box().max);
  tbb::parallel_for(first.x, last.x + 1, [&](int x) {
    for (int y = first.y; y <= last.y; ++y)
      for (int z = first.z; z <= last.z; ++z) {
        const Coord brick{x, y, z};
        const auto b = findBrick(volume, brick - brickOf(volume.origin));
        const bool inside = !b && levelSet.signs.agree() && levelSet.signs.isInside(brick);
        for (int i = 0; i < kBrickVoxels; ++i) {
          const Coord voxel = brick * kBrickSide + voxelLocal(i);
          if (!to.box().contains(voxel)) continue;
          to.at(voxel) = b        ? volume.brickValues(*b)[std::size_t(i)]
                         : inside ? -volume.background
                                  : volume.background;
        }
      }
  });
}

Box chosenBox(const PackedGrid& grid, const std::optional<PlainBox>& box) {
  const Box chosen = box ? boxOf(*box) : activeBox(grid);
  if (chosen.empty())
    throw UsageError(box ? "the box is empty" : "the grid has no active voxel; name a box");
  return chosen;
}

bool isXFastest(const std::string& order) {
  if (order != "C" && order != "F") throw UsageError("order is 'C' or 'F', not '" + order + "'");
  return order == "F";
}

py::array packedToNumpy(const Packed& self, const std::optional<PlainBox>& box,
                        const std::string& order) {
  const Box chosen = chosenBox(*self.grid, box);
  return std::visit(
      [&]<class T>(const PackedVoxels<T>& voxels) {
        BoxArray<T> array(chosen, isXFastest(order));
        interruptible([&] {
          if constexpr (std::is_same_v<T, float>)
            if (self.levelSet) return fillSigned(*self.levelSet, array);
          fillActive(voxels, array);
        });
        return array.array();
      },
      self.grid->voxels);
}

/// The active voxels of a box, which are the voxels of a mask.
py::array activeOf(const Packed& self, const std::optional<PlainBox>& box,
                   const std::string& order) {
  const Box chosen = chosenBox(*self.grid, box);
  const auto bricks = bricksOf(*self.grid);
  BoxArray<bool> array(chosen, isXFastest(order));
  interruptible([&] {
    fillActive(PackedVoxels<bool>{false, {bricks.begin(), bricks.end()}, {}}, array);
  });
  return array.array();
}

py::object backgroundOf(const PackedGrid& grid) {
  return std::visit([](const auto& voxels) { return py::cast(voxels.background); }, grid.voxels);
}

Volume toVolume(const Packed& self) {
  const auto* voxels = std::get_if<PackedVoxels<float>>(&self.grid->voxels);
  if (!voxels)
    throw UsageError("grid '" + shownName(self.grid->descriptor.name) + "' holds " +
                     valueTypeOf(*self.grid) + ", and a volume holds float");
  return interruptible([&] {
    GridDescriptor descriptor = self.grid->descriptor;
    descriptor.background = double(voxels->background);
    SparseVolume volume = self.levelSet ? self.levelSet->volume : unpacked(*voxels);
    return Volume{
        std::make_shared<VolumeGrid>(VolumeGrid{std::move(descriptor), std::move(volume)})};
  });
}

// -- files ---------------------------------------------------------------------------------------

/// A grid of a file as a caller names it: by its name, by its place, or as the only one.
struct GridChoice {
  std::optional<std::variant<std::size_t, std::string>> grid;

  /// \throws BadInput  there is no such grid. \throws UsageError  the file has not one grid only
  [[nodiscard]] NamedGrid in(std::vector<std::string> names,
                             const std::filesystem::path& path) const {
    const GridNames all(std::move(names));
    if (!grid && all.size() != 1)
      throw UsageError(path.string() + ": name one of its grids: " + all.list());
    if (!grid) return {0};
    if (const auto* name = std::get_if<std::string>(&*grid)) return all.find(*name, path);
    const std::size_t place = std::get<std::size_t>(*grid);
    if (place >= all.size())
      throw BadInput(path.string() + ": it has no grid number " + std::to_string(place) +
                     " (from 0), but " + std::to_string(all.size()) + " grids");
    return {place};
  }
};

Packed packedOf(VolumeGrid grid) {
  auto voxels = std::make_shared<const PackedGrid>(packed(grid.descriptor, grid.volume));
  if (grid.descriptor.gridClass != GridClass::kLevelSet ||
      !std::holds_alternative<PackedVoxels<float>>(voxels->voxels))
    return {std::move(voxels)};
  return {std::move(voxels), std::make_shared<const SignedVoxels>(std::move(grid.volume))};
}

Packed fromVdbFile(const std::filesystem::path& path, const GridChoice& choice,
                   const ReadOptions& options) {
  const VdbSummary summary = inspectVdb(path);
  std::vector<std::string> names;
  for (const GridSummary& grid : summary.grids) names.push_back(grid.name);
  const NamedGrid grid = choice.in(std::move(names), path);
  if (grid.component) return packedOf(readComponent(path, grid.place, *grid.component, options));
  const GridSummary& found = summary.grids[grid.place];
  if (found.gridClass == GridClass::kLevelSet && found.isScalar)
    return packedOf(readGrid(path, grid.place, options));
  return {std::make_shared<const PackedGrid>(readPacked(path, grid.place, options))};
}

EsvrFile contentOf(const std::filesystem::path& path, const std::optional<int64_t>& frame,
                   std::uint64_t maxBytes) {
  const ReadLimits limits{.maxBytes = maxBytes};
  if (frame) return SequenceReader(path, limits).read(*frame);
  if (holdsSequence(path))
    throw UsageError(path.string() + ": the file holds a sequence; name a frame (esvr.frames)");
  return readEsvr(path, limits);
}

Packed fromEsvrFile(const std::filesystem::path& path, const GridChoice& choice,
                    const std::optional<int64_t>& frame, const ReadOptions& options) {
  const EsvrFile file = contentOf(path, frame, options.maxBytes);
  const NamedGrid named = choice.in(namesInOrder(file), path);
  const GridOfFile grid = gridsInOrder(file)[named.place];
  if (named.component && !grid.isVector)
    throw BadInput(path.string() + ": grid \"" + shownName(nameOf(file, grid)) +
                   "\" has no components");
  if (grid.isCarried)
    return {std::make_shared<const PackedGrid>(readPacked(file.carried[grid.index], options))};
  const DecodeOptions decode{.maxBytes = options.maxBytes};
  if (grid.isVector && !named.component) {
    const StoredVector& vector = file.vectors[grid.index];
    return {std::make_shared<const PackedGrid>(
        packed(decodeVector(vector.name, componentsOf(file, vector), decode)))};
  }
  const StoredGrid& stored = grid.isVector
                                 ? componentsOf(file, file.vectors[grid.index])[*named.component]
                                 : file.grids[grid.index];
  return packedOf({stored.descriptor, decodeGrid(stored, decode)});
}

bool isEsvr(const std::filesystem::path& path, const std::optional<int64_t>& frame) {
  const bool is = path.extension() == ".esvr";
  if (frame && !is) throw UsageError(path.string() + ": only .esvr files have frames");
  return is;
}

Packed fromFile(const std::filesystem::path& path,
                const std::optional<std::variant<std::size_t, std::string>>& grid,
                const std::optional<int64_t>& frame,
                const std::optional<std::uint64_t>& maxMemory) {
  ReadOptions options{.maxBytes = memoryLimit(maxMemory)};
  options.allowEmpty = true;
  return interruptible([&] {
    return isEsvr(path, frame) ? fromEsvrFile(path, {grid}, frame, options)
                               : fromVdbFile(path, {grid}, options);
  });
}

using NameAndType = std::pair<std::string, std::string>;

std::string typeOf(const EsvrFile& file, const GridOfFile& grid) {
  if (grid.isCarried) return inspectCarried(file.carried[grid.index]).valueType;
  if (grid.isVector) return "vec3s";
  const bool isDouble = file.grids[grid.index].descriptor.valueType == ValueType::kDouble;
  return isDouble ? "double" : "float";
}

std::vector<NameAndType> listGrids(const std::filesystem::path& path,
                                   const std::optional<int64_t>& frame) {
  return interruptible([&] {
    std::vector<NameAndType> all;
    if (!isEsvr(path, frame)) {
      for (const GridSummary& grid : inspectVdb(path).grids)
        all.emplace_back(grid.uniqueName, grid.valueType);
      return all;
    }
    const EsvrFile file = contentOf(path, frame, usualMemoryLimit());
    const GridNames names(namesInOrder(file));
    for (const GridOfFile& grid : gridsInOrder(file))
      all.emplace_back(names.unique(all.size()), typeOf(file, grid));
    return all;
  });
}

void writeVdb(const std::filesystem::path& path, const std::vector<Packed>& grids,
              const py::dict& metadata, bool overwrite) {
  const auto items = itemsOf(metadata);
  std::vector<Volume> levelSets;  // a flood fill restores their signs
  levelSets.reserve(grids.size());
  std::vector<GridToWrite> all;
  for (const Packed& grid : grids)
    if (grid.levelSet)
      all.emplace_back(levelSets.emplace_back(toVolume(grid)).grid.get());
    else
      all.emplace_back(grid.grid.get());
  interruptible([&] { writeGrids(path, items, all, {.overwrite = overwrite}); });
}

void addBuilder(py::module_& module) {
  py::class_<Builder>(module, "GridBuilder",
                      "Makes a grid of an array that is given slab by slab. Only active voxels are "
                      "kept.")
      .def(
          py::init([](const std::string& type, const std::string& name,
                      const py::object& background, std::optional<double> threshold,
                      const std::string& gridClass, const std::optional<Matrix>& transform,
                      const py::dict& metadata, const std::optional<std::uint64_t>& maxBytes) {
            auto builder = makeBuilder(type, background, {threshold, memoryLimit(maxBytes)});
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
          py::arg("metadata") = py::dict(), py::arg("max_bytes") = py::none(),
          "type is 'float', 'double', 'int32', 'int64', 'bool' or 'vec3s'. transform is the 4 x 4\n"
          "matrix from index to world coordinates, for column vectors. metadata has texts,\n"
          "numbers, truth values and tuples of three integers or floats. max_bytes is a limit on "
          "the memory\n"
          "of the grid (default: half of the memory of the machine).")
      .def(
          "add",
          [](Builder& b, const py::array& array, const Corner& origin,
             const std::optional<py::array>& active) { b.add(array, origin, active); },
          py::arg("array"), py::arg("origin") = Corner{}, py::arg("active") = py::none(),
          "Adds an array with the axes x, y, z (and components), in any order in memory.\n\n"
          "origin is the voxel of array[0, 0, 0] and has multiples of 8; arrays must not share\n"
          "bricks of 8^3 voxels. Where active (bool, of the same axes) is not given, a voxel is\n"
          "active if it is not below the threshold, or, without one, if it differs from the\n"
          "background. Of a mask, only true voxels are active. No value is rounded: floats take\n"
          "integers of 8 and 16 bits and float32; doubles take these, integers of 32 bits and\n"
          "float64; integers take those that they hold; masks take bool, and vectors float32.")
      .def("finish", &finishBuilder,
           "The grid (esvr.PackedGrid). The builder is empty afterwards.");
}

void addPackedGrid(py::module_& module) {
  py::class_<Packed> type(
      module, "PackedGrid",
      "The active voxels of a grid of numbers, truth values or vectors, with all "
      "their bits.");
  addDescriptor(type);
  type.def_static(
          "from_file", &fromFile, py::arg("path"), py::arg("grid") = py::none(), py::kw_only(),
          py::arg("frame") = py::none(), py::arg("max_memory") = py::none(),
          "Reads a grid of a .vdb, .nvdb or .esvr file, of which it decodes the voxels.\n\n"
          "grid is a name as for --grid of the programs, or a place in esvr.list_grids(path);\n"
          "it may be left out if there is one grid only. frame is one of esvr.frames(path).\n"
          "Of a mask, the true voxels are active; doubles of vectors become floats.")
      .def("to_numpy", &packedToNumpy, py::arg("box") = py::none(), py::kw_only(),
           py::arg("order") = "C",
           "The voxels of a box ((x0, y0, z0), (x1, y1, z1)), both inclusive, with the axes x, y, "
           "z\n"
           "(and components); by default those of PackedGrid.box. Inactive voxels have the\n"
           "background; inside a level set, they have its negative. In the order 'F', x is the\n"
           "fastest axis in memory, in 'C' z; the components of a vector are always together.")
      .def("active", &activeOf, py::arg("box") = py::none(), py::kw_only(), py::arg("order") = "C",
           "Which voxels of a box are active: bool with the axes x, y, z.")
      .def("to_volume", &toVolume, "A volume with the voxels of a grid of floats.")
      .def_property_readonly(
          "value_type", [](const Packed& p) { return valueTypeOf(*p.grid); },
          "\"float\", \"double\", \"int32\", \"int64\", \"bool\" or \"vec3s\".")
      .def_property_readonly(
          "background", [](const Packed& p) { return backgroundOf(*p.grid); },
          "The value of voxels that are not active.")
      .def_property_readonly(
          "active_voxels", [](const Packed& p) { return activeVoxelCount(*p.grid); },
          "Number of active voxels.")
      .def_property_readonly(
          "box", [](const Packed& p) { return plainBox(activeBox(*p.grid)); },
          "The first and the last active voxel along each axis; None if there is none.")
      .def_property_readonly(
          "metadata", [](const Packed& p) { return dictOf(p.grid->descriptor.metadata); },
          "The grid's metadata that are texts, numbers, truth values or three numbers.");
}

}  // namespace

void addPacked(py::module_& module) {
  addBuilder(module);
  addPackedGrid(module);
  module.def(
      "write_vdb", &writeVdb, py::arg("path"), py::arg("grids"), py::kw_only(),
      py::arg("metadata") = py::dict(), py::arg("overwrite") = false,
      "Writes packed grids to a .vdb file, or grids of floats to a .nvdb file. metadata are\n"
      "those of the file.");
  module.def(
      "list_grids", &listGrids, py::arg("path"), py::kw_only(), py::arg("frame") = py::none(),
      "The unique names and the types of the grids of a .vdb, .nvdb or .esvr file, in their\n"
      "order. Types are OpenVDB's: 'float', 'vec3s', 'ptdataidx32', ...");
}

}  // namespace esvr::python
