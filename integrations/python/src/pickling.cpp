// Pickling and copying, for multiprocessing and for what is made with it. Objects do not change, so that a copy is
// the object itself. Grids and files are pickled as the bytes of an .esvr file, and voxels as arrays of NumPy, which
// pickle can pass on without copying them.

#include <pybind11/stl.h>

#include <cstring>
#include <span>

#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/metrics.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

/// The first element of all states. Another number is that of another version of this module.
constexpr int kStateVersion = 1;

void requireVersion(int version) {
  if (version != kStateVersion)
    throw BadInput("the object was pickled by another version of esvr; pickle it again");
}

[[noreturn]] void damaged() { throw BadInput("the pickled object is damaged"); }

// Bytes.

py::array bytesArray(const void* data, std::size_t size) {
  py::array_t<std::uint8_t> array{py::ssize_t(size)};
  if (size > 0) std::memcpy(array.mutable_data(), data, size);
  return array;
}

using ByteArray = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>;

/// Objects without pointers are pickled as their bytes.
template <class T>
py::array plainBytes(const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  return bytesArray(&value, sizeof value);
}

template <class T>
T plainFrom(const ByteArray& bytes) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (std::size_t(bytes.size()) != sizeof(T)) damaged();
  T value{};
  std::memcpy(static_cast<void*>(&value), bytes.data(), sizeof value);
  return value;
}

/// The elements of a vector as an array. \tparam Number  of which an element consists
template <class Number, class Element>
py::array arrayOf(const Element* first, std::size_t count) {
  static_assert(std::is_trivially_copyable_v<Element> && sizeof(Element) % sizeof(Number) == 0);
  py::array_t<Number> array({py::ssize_t(count), py::ssize_t(sizeof(Element) / sizeof(Number))});
  if (count > 0) std::memcpy(array.mutable_data(), first, count * sizeof(Element));
  return array;
}

/// The number of elements of an array of arrayOf(). \throws BadInput  it has another shape
template <class Number, class Element>
std::size_t countIn(const py::array_t<Number>& array) {
  if (array.ndim() != 2 || array.shape(1) != py::ssize_t(sizeof(Element) / sizeof(Number)))
    damaged();
  return std::size_t(array.shape(0));
}

template <class Number, class Element>
std::vector<Element> vectorFrom(const py::object& object) {
  const auto array = py::array_t<Number, py::array::c_style | py::array::forcecast>(object);
  std::vector<Element> elements(countIn<Number, Element>(array));
  if (!elements.empty())
    std::memcpy(static_cast<void*>(elements.data()), array.data(),
                elements.size() * sizeof(Element));
  return elements;
}

// Properties of grids. Texts are bytes, because names need not be UTF-8.

py::bytes bytesOf(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::vector<std::byte> bytesFrom(const py::handle& object) {
  const auto text = py::cast<std::string>(object);
  const auto* const first = reinterpret_cast<const std::byte*>(text.data());
  return {first, first + text.size()};
}

py::tuple stateOf(const GridDescriptor& grid) {
  py::list metadata;
  for (const MetaItem& item : grid.metadata)
    metadata.append(
        py::make_tuple(py::bytes(item.name), py::bytes(item.type), bytesOf(item.value)));
  return py::make_tuple(py::bytes(grid.name), int(grid.gridClass), int(grid.valueType),
                        grid.background, py::bytes(grid.transform.mapType),
                        bytesOf(grid.transform.map), grid.transform.affine, metadata);
}

GridDescriptor descriptorFrom(const py::tuple& state) {
  GridDescriptor grid;
  grid.name = state[0].cast<std::string>();
  grid.gridClass = GridClass(state[1].cast<int>());
  grid.valueType = ValueType(state[2].cast<int>());
  grid.background = state[3].cast<double>();
  grid.transform = {state[4].cast<std::string>(), bytesFrom(state[5]),
                    state[6].cast<std::optional<std::array<double, 16>>>()};
  for (const py::handle item : state[7]) {
    const auto parts = py::cast<py::tuple>(item);
    grid.metadata.push_back(
        {parts[0].cast<std::string>(), parts[1].cast<std::string>(), bytesFrom(parts[2])});
  }
  return grid;
}

// Voxels.

py::tuple stateOf(const SparseVolume& volume) {
  const std::size_t bricks = volume.brickCount();
  using BrickValues = std::array<float, kBrickVoxels>;
  static_assert(sizeof(Coord) == 3 * sizeof(std::int32_t));
  return py::make_tuple(
      plainBytes(volume.origin), volume.background,
      arrayOf<std::int32_t>(volume.bricks.data(), bricks),
      arrayOf<std::uint64_t>(volume.active.data(), bricks),
      arrayOf<float>(reinterpret_cast<const BrickValues*>(volume.values.data()), bricks));
}

SparseVolume volumeFrom(const py::tuple& state) {
  SparseVolume volume;
  volume.origin = plainFrom<Coord>(state[0].cast<ByteArray>());
  volume.background = state[1].cast<float>();
  volume.bricks = vectorFrom<std::int32_t, Coord>(state[2]);
  volume.active = vectorFrom<std::uint64_t, BrickMask>(state[3]);
  const auto values =
      state[4].cast<py::array_t<float, py::array::c_style | py::array::forcecast>>();
  if (std::size_t(values.size()) != volume.brickCount() * kBrickVoxels) damaged();
  volume.values.assign(values.data(), values.data() + values.size());
  try {
    checkInvariants(volume);
  } catch (const std::logic_error&) {
    damaged();
  }
  return volume;
}

py::tuple stateOf(const Volume& volume) {
  return py::make_tuple(kStateVersion, stateOf(volume.grid->descriptor),
                        stateOf(volume.grid->volume), volume.grid->nonFiniteReplaced,
                        plainBytes(volume.grid->inactive), volume.roundedValues);
}

Volume restoreVolume(const py::tuple& state) {
  requireVersion(state[0].cast<int>());
  auto grid = std::make_shared<VolumeGrid>();
  grid->descriptor = descriptorFrom(state[1]);
  grid->volume = volumeFrom(state[2]);
  grid->nonFiniteReplaced = state[3].cast<std::uint64_t>();
  grid->inactive = plainFrom<InactiveValues>(state[4].cast<ByteArray>());
  return {std::move(grid), state[5].cast<std::uint64_t>()};
}

// Packed grids. The values of a grid are joined to one part.

template <class T>
using NumberOf = std::conditional_t<std::is_same_v<T, PackedVector>, float, T>;

template <class T>
std::vector<T> joined(const PackedVoxels<T>& voxels) {
  std::vector<T> values;
  for (std::size_t b = 0; b < voxels.bricks.size(); ++b)
    for (int n = 0; n < voxels.bricks[b].active.count(); ++n) values.push_back(voxels.value(b, n));
  return values;
}

template <class T>
py::object valuesOf(const PackedVoxels<T>& voxels) {
  if constexpr (std::is_same_v<T, bool>) {
    return py::none();
  } else {
    const std::vector<T> values = joined(voxels);
    return arrayOf<NumberOf<T>>(values.data(), values.size());
  }
}

py::tuple stateOf(const Packed& packed) {
  const PackedGrid& grid = *packed.grid;
  std::vector<Coord> corners;
  std::vector<BrickMask> active;
  for (const PackedBrick& brick : bricksOf(grid)) {
    corners.push_back(brick.corner);
    active.push_back(brick.active);
  }
  const py::object values = std::visit([](const auto& v) { return valuesOf(v); }, grid.voxels);
  const py::object background =
      std::visit([](const auto& v) { return py::cast(v.background); }, grid.voxels);
  const py::object levelSet =
      packed.levelSet ? py::object(stateOf(packed.levelSet->volume)) : py::none();
  return py::make_tuple(kStateVersion, stateOf(grid.descriptor), grid.voxels.index(), background,
                        arrayOf<std::int32_t>(corners.data(), corners.size()),
                        arrayOf<std::uint64_t>(active.data(), active.size()), values, levelSet);
}

/// \param bricks  whose first values are set
template <class T>
PackedVoxels<T> voxelsFrom(const py::tuple& state, std::vector<PackedBrick> bricks) {
  PackedVoxels<T> voxels;
  voxels.background = state[3].cast<T>();
  std::uint64_t count = 0;
  for (PackedBrick& brick : bricks) {
    brick.first = count;
    count += std::uint64_t(brick.active.count());
  }
  voxels.bricks = std::move(bricks);
  if constexpr (!std::is_same_v<T, bool>) {
    voxels.parts.push_back(vectorFrom<NumberOf<T>, T>(state[6]));
    if (voxels.parts.front().size() != count) damaged();
  }
  return voxels;
}

std::vector<PackedBrick> bricksFrom(const py::tuple& state) {
  const auto corners = vectorFrom<std::int32_t, Coord>(state[4]);
  const auto active = vectorFrom<std::uint64_t, BrickMask>(state[5]);
  if (corners.size() != active.size()) damaged();
  std::vector<PackedBrick> bricks;
  for (std::size_t b = 0; b < corners.size(); ++b) bricks.push_back({corners[b], active[b]});
  return bricks;
}

template <std::size_t index = 0>
AnyPackedVoxels anyVoxelsFrom(const py::tuple& state, std::size_t wanted) {
  if constexpr (index < std::variant_size_v<AnyPackedVoxels>) {
    using Voxels = std::variant_alternative_t<index, AnyPackedVoxels>;
    using T = decltype(Voxels::background);
    if (index == wanted) return voxelsFrom<T>(state, bricksFrom(state));
    return anyVoxelsFrom<index + 1>(state, wanted);
  } else {
    damaged();
  }
}

Packed restorePacked(const py::tuple& state) {
  requireVersion(state[0].cast<int>());
  Packed packed{std::make_shared<const PackedGrid>(
      PackedGrid{descriptorFrom(state[1]), anyVoxelsFrom(state, state[2].cast<std::size_t>())})};
  if (const py::object signs = state[7]; !signs.is_none())
    packed.levelSet = std::make_shared<const SignedVoxels>(volumeFrom(signs));
  return packed;
}

// Grids and files.

constexpr const char* kPickled = "the pickled object";

py::tuple stateOf(const File& file) {
  const auto bytes = interruptible([&] { return encodeEsvr(*file.file); });
  return py::make_tuple(kStateVersion, bytesArray(bytes.data(), bytes.size()));
}

File restoreFile(const py::tuple& state) {
  requireVersion(state[0].cast<int>());
  const auto array = state[1].cast<ByteArray>();
  const std::span bytes(reinterpret_cast<const std::byte*>(array.data()),
                        std::size_t(array.size()));
  return interruptible([&] {
    return File{std::make_shared<const EsvrFile>(
        decodeEsvr(bytes, kPickled, {.maxBytes = usualMemoryLimit()}))};
  });
}

/// A grid as the only one of a file. The grid to which its voxels refer only made them smaller.
py::tuple stateOf(const Grid& grid) {
  EsvrFile file;
  file.grids.push_back(*grid.grid);
  file.grids.back().reference.reset();
  return stateOf(File{std::make_shared<const EsvrFile>(std::move(file))});
}

Grid restoreGrid(const py::tuple& state) {
  const File file = restoreFile(state);
  if (file.file->grids.size() != 1) damaged();
  return {std::shared_ptr<const StoredGrid>(file.file, &file.file->grids.front())};
}

// Figures and ellipsoids.

py::tuple stateOf(const VolumeMetrics& metrics) {
  return py::make_tuple(kStateVersion, plainBytes(metrics));
}

VolumeMetrics restoreMetrics(const py::tuple& state) {
  requireVersion(state[0].cast<int>());
  return plainFrom<VolumeMetrics>(state[1].cast<ByteArray>());
}

py::tuple stateOf(const Ellipsoids& e) {
  return py::make_tuple(kStateVersion, e.mu, e.scale, e.quaternion, e.intensity, e.kappa,
                        e.epsilon);
}

Ellipsoids restoreEllipsoids(const py::tuple& state) {
  requireVersion(state[0].cast<int>());
  using Floats = py::array_t<float>;
  const Ellipsoids e{state[1].cast<py::array_t<double>>(),
                     state[2].cast<Floats>(),
                     state[3].cast<Floats>(),
                     state[4].cast<Floats>(),
                     state[5].cast<Floats>(),
                     state[6].cast<double>()};
  for (const py::array& array :
       std::initializer_list<py::array>{e.mu, e.scale, e.quaternion, e.intensity, e.kappa})
    array.attr("setflags")(py::arg("write") = false);
  return e;
}

/// \param name     of the function of the module, with an underscore before it, that esvr._restore() calls, because pickle
///                 cannot name functions of the module
/// \param restore  makes an object of what stateOf() gives
template <class T>
void addTo(py::module_& module, const std::string& name, T (*restore)(const py::tuple&)) {
  module.def(("_" + name).c_str(), restore, py::arg("state"));
  const py::object type = py::type::of<T>();
  const auto method = [&](const char* called, const auto& function) {
    py::setattr(type, called, py::cpp_function(function, py::name(called), py::is_method(type)));
  };
  method("__reduce__", [name](const T& self) {
    const py::object function = py::module_::import("esvr").attr("_restore");
    return py::make_tuple(function, py::make_tuple("_" + name, stateOf(self)));
  });
  method("__copy__", [](const py::object& self) { return self; });
  method("__deepcopy__", [](const py::object& self, const py::object&) { return self; });
}

}  // namespace

void addPickling(py::module_& module) {
  addTo<Volume>(module, "volume_from", &restoreVolume);
  addTo<Packed>(module, "packed_grid_from", &restorePacked);
  addTo<Grid>(module, "grid_from", &restoreGrid);
  addTo<File>(module, "file_from", &restoreFile);
  addTo<VolumeMetrics>(module, "metrics_from", &restoreMetrics);
  addTo<Ellipsoids>(module, "ellipsoids_from", &restoreEllipsoids);
}

}  // namespace esvr::python
