// esvr.Volume.

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "esvr/error.h"
#include "esvr/grid.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;
using FlagArray = py::array_t<bool, py::array::c_style | py::array::forcecast>;

/// Voxels of an array of Python, with z fastest.
struct Dense {
  const float* values;
  const bool* masked;  ///< null: no element is masked
  const bool* active;  ///< null: values say which voxels are active
  Coord side;
  Box box;
  bool keepsNonFinite = false;
  bool isLevelSet = false;  ///< inactive voxels have the background with the sign of their value

  [[nodiscard]] std::size_t placeOf(Coord voxel) const {
    const Coord v = voxel - box.min;
    return (std::size_t(v.x) * side.y + v.y) * side.z + v.z;
  }
};

/// An array of Python as numbers of this project.
struct Numbers {
  FloatArray values;
  std::optional<FlagArray> masked;  ///< of a masked array: true for elements without a value
  /// Elements, masked or not, whose float differs from the number. Integers have none.
  py::array_t<bool> rounded;
  bool areRounded = false;  ///< whether any element is rounded
};

std::string voxelIn(const py::array& flags, const Corner& origin) {
  const py::object place =
      py::module_::import("numpy").attr("argwhere")(flags).attr("__getitem__")(0);
  std::string text;
  for (int a = 0; a < 3; ++a)
    text += (a == 0 ? "(" : ", ") +
            std::to_string(origin[a] + place.attr("__getitem__")(a).cast<std::int64_t>());
  return text + ")";
}

/// Refuses arrays of dates, records, text, objects and complex numbers, which NumPy would turn into
/// floats that mean nothing.
void requireNumbers(const py::array& array) {
  const char kind = array.dtype().kind();
  if (kind == 'c')
    throw UsageError(
        "the array has complex numbers; give one of array.real, array.imag and abs(array)");
  if (std::string("biuf").find(kind) == std::string::npos)
    throw UsageError("the array has elements of type " +
                     py::str(array.dtype()).cast<std::string>() +
                     ", and a volume has numbers; array.astype('float32') says what they are");
}

void requireShape(const py::array& array, const Corner& origin) {
  if (array.ndim() != 3)
    throw UsageError("the array has " + std::to_string(array.ndim()) +
                     " axes, and a volume has 3: x, y, z");
  for (int a = 0; a < 3; ++a) {
    const double last = double(origin[a]) + double(array.shape(a)) - 1.0;
    if (array.shape(a) == 0) throw UsageError("the array has no voxels");
    if (last > Box::kMax) throw UsageError("the array ends outside the index space");
  }
}

/// The array that NumPy makes of something, with what a mask hides.
py::array plainArray(const py::module_& numpy, const py::object& given) try {
  return numpy.attr("asarray")(given);
} catch (const py::error_already_set& error) {
  if (!error.matches(PyExc_ValueError)) throw;  // lists of lists of different lengths
  throw UsageError("NumPy makes no array of it: " + py::str(error.value()).cast<std::string>());
}

/// Converts an array to floats. Integers and elements that would become infinite must not change.
Numbers numbersOf(const py::object& given, const Corner& origin) {
  const py::module_ numpy = py::module_::import("numpy");
  const py::object ma = numpy.attr("ma");
  Numbers numbers;
  if (py::isinstance(given, ma.attr("MaskedArray")))
    numbers.masked = FlagArray(ma.attr("getmaskarray")(given));
  const py::array plain = plainArray(numpy, given);
  requireNumbers(plain);
  requireShape(plain, origin);
  const py::object quiet =
      numpy.attr("errstate")(py::arg("over") = "ignore", py::arg("invalid") = "ignore");
  quiet.attr("__enter__")();
  numbers.values = FloatArray(plain);
  quiet.attr("__exit__")(py::none(), py::none(), py::none());
  const char kind = plain.dtype().kind();
  constexpr py::ssize_t kExactBytes = 2;  // integers of 16 bits and half floats are exact
  if (kind == 'b' || plain.dtype().itemsize() <= kExactBytes ||
      (kind == 'f' && plain.dtype().itemsize() == py::ssize_t(sizeof(float))))
    return numbers;
  // float64 has all floats, and all integers of 32 bits. Those of 64 bits are compared as integers
  // and need not fit: floats up to 2^63 are integers too.
  py::object differs;
  if (kind == 'f') {
    const py::object finite = numpy.attr("isfinite")(plain);
    const py::object wide = numbers.values.attr("astype")(plain.dtype());
    differs = numpy.attr("not_equal")(plain, wide).attr("__and__")(finite);
    const py::object lost =
        finite.attr("__and__")(numpy.attr("isfinite")(numbers.values).attr("__invert__")());
    py::object seen = lost;
    if (numbers.masked) seen = lost.attr("__and__")(numbers.masked->attr("__invert__")());
    if (seen.attr("any")().cast<bool>())
      throw UsageError("the value of voxel " + voxelIn(seen, origin) +
                       " is beyond the range of float32; scale the array");
  } else {
    // The largest float below 2^63 or 2^64 becomes the type's limit, which differs from it.
    const bool isSigned = kind == 'i';
    const py::object limit =
        isSigned ? py::float_(9223372036854774784.0) : py::float_(18446744073709549568.0);
    const py::object wide = numpy.attr("minimum")(numbers.values.attr("astype")("float64"), limit)
                                .attr("astype")(isSigned ? "int64" : "uint64");
    differs = numpy.attr("not_equal")(plain, wide);
    if (numbers.masked) differs = differs.attr("__and__")(numbers.masked->attr("__invert__")());
    if (differs.attr("any")().cast<bool>())
      throw UsageError(
          "the integer of voxel " + voxelIn(differs, origin) +
          " is no float32, which has all integers up to 2^24 only; subtract an offset, keep the "
          "remainders and the quotients in two grids, or convert the array yourself if the "
          "difference does not matter: array.astype('float32')");
    return numbers;
  }
  numbers.areRounded = differs.attr("any")().cast<bool>();
  if (numbers.areRounded) numbers.rounded = py::array_t<bool>(differs);
  return numbers;
}

/// A voxel of the array is active if it is not masked, and if the caller says so, or else if it differs from
/// the background by more than the threshold. NaN and infinities are active.
BrickInput brickOfArray(const Dense& dense, Coord corner, float background, float threshold) {
  BrickInput brick{corner, {}, {}};
  brick.values.fill(background);
  for (int i = 0; i < kBrickVoxels; ++i) {
    const Coord voxel = corner + voxelLocal(i);
    if (!dense.box.contains(voxel)) continue;
    const std::size_t place = dense.placeOf(voxel);
    if (dense.masked != nullptr && dense.masked[place]) continue;
    const float value = dense.values[place];
    if (dense.isLevelSet && value < 0.0f) brick.values[i] = -std::abs(background);
    if (dense.active != nullptr && !dense.active[place]) continue;
    if (!std::isfinite(value)) {
      if (!dense.keepsNonFinite)
        throw BadInput("the value of voxel " + toString(voxel) +
                       " is not finite; nonfinite='keep' keeps such values");
      brick.values[i] = std::isnan(value) ? std::numeric_limits<float>::quiet_NaN() : value;
      brick.active.set(i);
      continue;
    }
    if (dense.active == nullptr && !(std::abs(value - background) > threshold)) continue;
    brick.values[i] = value;
    brick.active.set(i);
  }
  return brick;
}

std::vector<BrickInput> bricksOf(const Dense& dense, float background, float threshold) {
  const Coord first = brickOf(dense.box.min), last = brickOf(dense.box.max);
  std::vector<std::vector<BrickInput>> slices(std::size_t(last.x - first.x + 1));
  tbb::parallel_for(std::size_t(0), slices.size(), [&](std::size_t s) {
    for (int y = first.y; y <= last.y; ++y)
      for (int z = first.z; z <= last.z; ++z) {
        const Coord corner = Coord{first.x + int(s), y, z} * kBrickSide;
        auto brick = brickOfArray(dense, corner, background, threshold);
        if (brick.active.count() > 0) slices[s].push_back(std::move(brick));
      }
  });
  std::vector<BrickInput> bricks;
  for (auto& slice : slices) bricks.insert(bricks.end(), slice.begin(), slice.end());
  return bricks;
}

struct ArrayOptions {
  float background, threshold;
  Corner origin;
  std::optional<FlagArray> active;
  Transform transform;
  std::string name;
  GridClass gridClass;
  std::vector<MetaItem> metadata;
  NonFinite nonFinite = NonFinite::kRefuse;
};

/// The transform of a voxel size or of a matrix, of which one may be given.
Transform transformOf(const std::optional<double>& voxelSize, const std::optional<Matrix>& matrix) {
  if (voxelSize && matrix) throw UsageError("give voxel_size or transform, not both");
  if (matrix) return transformFrom(*matrix);
  const double side = voxelSize.value_or(1.0);
  if (!(side > 0.0) || !std::isfinite(side))
    throw UsageError("voxel_size must be finite and above 0");
  return uniformTransform(side);
}

GridClass classOf(const std::string& name, bool levelSet) {
  if (!levelSet) return classFrom(name);
  if (name != className(GridClass::kFogVolume))
    throw UsageError("give level_set or grid_class, not both");
  return GridClass::kLevelSet;
}

void requireSameShape(const FlagArray& active, const FloatArray& values) {
  const bool isSame = active.ndim() == 3 && active.shape(0) == values.shape(0) &&
                      active.shape(1) == values.shape(1) && active.shape(2) == values.shape(2);
  if (!isSame) throw UsageError("active must have the shape of the array");
}

/// The number of active voxels whose float differs from the number of the array.
std::uint64_t roundedOf(const Numbers& numbers, const Dense& dense, const SparseVolume& volume) {
  if (!numbers.areRounded) return 0;
  const bool* const rounded = numbers.rounded.data();
  std::uint64_t count = 0;
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i)
      if (volume.active[b].test(i) && rounded[dense.placeOf(volume.brickCorner(b) + voxelLocal(i))])
        ++count;
  return count;
}

Volume fromNumpy(const py::object& array, const ArrayOptions& options) {
  if (!std::isfinite(options.background)) throw UsageError("background must be finite");
  if (!(options.threshold >= 0.0f)) throw UsageError("threshold must be 0 or above");
  const Numbers numbers = numbersOf(array, options.origin);
  if (options.active) requireSameShape(*options.active, numbers.values);
  const Coord side{std::int32_t(numbers.values.shape(0)), std::int32_t(numbers.values.shape(1)),
                   std::int32_t(numbers.values.shape(2))};
  const Coord first = coordOf(options.origin);
  const Dense dense{.values = numbers.values.data(),
                    .masked = numbers.masked ? numbers.masked->data() : nullptr,
                    .active = options.active ? options.active->data() : nullptr,
                    .side = side,
                    .box = {first, first + (side - Coord{1, 1, 1})},
                    .keepsNonFinite = options.nonFinite == NonFinite::kKeep,
                    .isLevelSet = options.gridClass == GridClass::kLevelSet};
  const py::gil_scoped_release release;
  auto grid = std::make_shared<VolumeGrid>();
  grid->descriptor.name = options.name;
  grid->descriptor.gridClass = options.gridClass;
  grid->descriptor.background = options.background;
  grid->descriptor.transform = options.transform;
  grid->descriptor.metadata = options.metadata;
  grid->volume =
      makeVolume(bricksOf(dense, options.background, options.threshold), options.background);
  const std::uint64_t rounded = roundedOf(numbers, dense, grid->volume);
  return {std::move(grid), rounded};
}

}  // namespace

void requireAddressable(const Box& box, std::size_t bytesOfElement) {
  const double bytes = (double(box.max.x) - box.min.x + 1.0) *
                       (double(box.max.y) - box.min.y + 1.0) *
                       (double(box.max.z) - box.min.z + 1.0) * double(bytesOfElement);
  constexpr auto kMost = std::uint64_t(std::numeric_limits<py::ssize_t>::max());
  requireWithinMemory(bytes, kMost, "an array over the box");
}

namespace {

Box boxOrActive(const SparseVolume& volume, const std::optional<PlainBox>& box) {
  const Box chosen = box ? boxOf(*box) : activeBox(volume);
  if (chosen.empty())
    throw UsageError(box ? "the box is empty" : "the volume has no active voxel; name a box");
  return chosen;
}

/// An array over a box. \param valueAt  the element of a voxel by its brick and its offset there
template <class T, class ValueAt>
py::array_t<T> arrayOver(const SparseVolume& volume, const std::optional<PlainBox>& plain,
                         T outside, const ValueAt& valueAt) {
  const Box box = boxOrActive(volume, plain);
  requireAddressable(box, sizeof(T));
  const auto length = [&](std::int32_t low, std::int32_t high) {
    return py::ssize_t(high) - low + 1;
  };
  py::array_t<T> array(
      {length(box.min.x, box.max.x), length(box.min.y, box.max.y), length(box.min.z, box.max.z)});
  T* values = array.mutable_data();
  const py::ssize_t ny = array.shape(1), nz = array.shape(2), size = array.size();
  const py::gil_scoped_release release;
  std::fill(values, values + size, outside);
  tbb::parallel_for(std::size_t(0), volume.brickCount(), [&](std::size_t b) {
    const Coord corner = volume.brickCorner(b);
    for (int i = 0; i < kBrickVoxels; ++i) {
      const Coord voxel = corner + voxelLocal(i);
      if (!box.contains(voxel)) continue;
      const Coord v = voxel - box.min;
      values[(v.x * ny + v.y) * nz + v.z] = valueAt(b, i);
    }
  });
  return array;
}

py::array_t<float> toNumpy(const Volume& self, const std::optional<PlainBox>& box) {
  const SparseVolume& volume = self.grid->volume;
  return arrayOver(volume, box, volume.background,
                   [&](std::size_t b, int i) { return volume.brickValues(b)[std::size_t(i)]; });
}

py::array_t<bool> activeIn(const Volume& self, const std::optional<PlainBox>& box) {
  const SparseVolume& volume = self.grid->volume;
  return arrayOver(volume, box, false,
                   [&](std::size_t b, int i) { return volume.active[b].test(i); });
}

/// The place of the first grid that a fit can take.
std::size_t firstOfNumbers(const std::filesystem::path& path) {
  const VdbSummary summary = inspectVdb(path);
  const auto& grids = summary.grids;
  const auto first = std::find_if(grids.begin(), grids.end(),
                                  [](const GridSummary& g) { return g.skipReason.empty(); });
  if (first == grids.end())
    throw BadInput(path.string() + ": no grid of numbers has an active voxel");
  return std::size_t(first - grids.begin());
}

constexpr const char* kWayOut =
    "; the program vdb2esvr carries such a grid of a .vdb file unchanged (--keep NAME)";

constexpr const char* kKeepsThem = "; nonfinite='keep' keeps such values";

Volume fromFile(VolumeGrid grid) {
  const std::uint64_t rounded = grid.narrowing.errors.count();
  return {std::make_shared<const VolumeGrid>(std::move(grid)), rounded};
}

Volume fromVdb(const std::filesystem::path& path, const std::optional<std::string>& name,
               NonFinite nonFinite) {
  const ReadOptions read{.nonFinite = nonFinite};
  return interruptible([&] {
    try {
      return fromFile(name ? readGrid(path, *name, read)
                           : readGrid(path, firstOfNumbers(path), read));
    } catch (const NotFinite& error) {
      throw BadInput(error.what() + std::string(kKeepsThem) + kWayOut);
    } catch (const CannotConvert& error) {
      throw BadInput(error.what() + std::string(kWayOut));
    } catch (const MemoryExceeded& error) {
      throw MemoryExceeded(error.what() + std::string(kWayOut));
    }
  });
}

/// The only grid of a file, which may have no active voxel.
Volume fromOnlyGrid(const std::filesystem::path& path, NonFinite nonFinite) {
  return interruptible([&] {
    constexpr std::size_t kOnly = 0;
    try {
      return fromFile(readGrid(path, kOnly, {.nonFinite = nonFinite, .allowEmpty = true}));
    } catch (const NotFinite& error) {
      throw BadInput(error.what() + std::string(kKeepsThem));
    }
  });
}

void write(const Volume& self, const std::filesystem::path& path, const WriteOptions& options) {
  interruptible([&] {
    const GridToWrite grid = self.grid.get();
    writeGrids(path, {}, std::span(&grid, 1), options);
  });
}

std::uint64_t nonFiniteCount(const SparseVolume& volume) {
  std::uint64_t count = 0;
  for (const float value : volume.values) count += !std::isfinite(value);
  return count;
}

}  // namespace

NonFinite nonFiniteOf(const std::string& word) {
  if (word == "refuse") return NonFinite::kRefuse;
  if (word == "keep") return NonFinite::kKeep;
  throw UsageError("nonfinite is one of refuse, keep, not '" + word + "'");
}

void addVolume(py::module_& module) {
  py::class_<Volume> type(module, "Volume",
                          "A sparse volume: voxels that are active, and a background elsewhere.");
  addDescriptor(type);
  type.def_static(
          "from_numpy",
          [](const py::object& array, float background, const Corner& origin, float threshold,
             const std::optional<double>& voxelSize, const std::string& name, bool levelSet,
             const std::optional<FlagArray>& active, const std::optional<Matrix>& transform,
             const std::string& gridClass, const py::dict& metadata, const std::string& nonFinite) {
            return fromNumpy(
                array,
                {background, threshold, origin, active, transformOf(voxelSize, transform), name,
                 classOf(gridClass, levelSet), itemsOf(metadata), nonFiniteOf(nonFinite)});
          },
          py::arg("array"), py::kw_only(), py::arg("background") = 0.0f,
          py::arg("origin") = Corner{}, py::arg("threshold") = 0.0f,
          py::arg("voxel_size") = py::none(), py::arg("name") = "density",
          py::arg("level_set") = false, py::arg("active") = py::none(),
          py::arg("transform") = py::none(), py::arg("grid_class") = "fog volume",
          py::arg("metadata") = py::dict(), py::arg("nonfinite") = "refuse",
          "Makes a volume from an array of shape (nx, ny, nz), converted to float32.\n\n"
          "A voxel is active if it differs from the background by more than the threshold, or, "
          "with\n"
          "active (bool of the same shape), where that is true.\n"
          "Elements that a masked array hides are not active, whatever their values are.\n"
          "Integers that float32 does not have (2**24 + 1), numbers beyond its range, dates,\n"
          "records, text and complex numbers are refused. Volume.rounded_values counts active\n"
          "voxels whose double was rounded.\n"
          "origin is the voxel of array[0, 0, 0]. voxel_size is in world units (default: 1);\n"
          "transform is the 4 x 4 matrix from index to world coordinates, for column vectors.\n"
          "grid_class is 'fog volume' or 'unknown'. metadata has texts, numbers, truth values and\n"
          "tuples of three integers or floats. nonfinite is 'refuse', or 'keep': NaN and\n"
          "infinities are active voxels.")
      .def_static(
          "from_vdb",
          [](const std::filesystem::path& path, const std::optional<std::string>& name,
             const std::string& nonFinite) { return fromVdb(path, name, nonFiniteOf(nonFinite)); },
          py::arg("path"), py::arg("grid") = py::none(), py::kw_only(),
          py::arg("nonfinite") = "refuse",
          "Reads a grid of numbers of a .vdb or .nvdb file; the first one by default. It is named\n"
          "as for --grid of the programs: \"density[1]\" is the second grid of a name, \"vel.x\" "
          "a\n"
          "component of vectors. nonfinite is that of from_numpy.")
      .def("to_numpy", &toNumpy, py::arg("box") = py::none(),
           "The voxels of a box ((x0, y0, z0), (x1, y1, z1)), both inclusive, as float32 of shape\n"
           "(nx, ny, nz); by default those of Volume.box.")
      .def("active", &activeIn, py::arg("box") = py::none(),
           "Which voxels of a box are active: bool of shape (nx, ny, nz).")
      .def(
          "save",
          [](const Volume& v, const std::filesystem::path& path, bool overwrite) {
            write(v, path, {.overwrite = overwrite});
          },
          py::arg("path"), py::kw_only(), py::arg("overwrite") = false,
          "Writes a .vdb or .nvdb file with this grid.")
      // For esvr/_openvdb.py.
      .def_static(
          "_from_only_grid",
          [](const std::filesystem::path& path, const std::string& nonFinite) {
            return fromOnlyGrid(path, nonFiniteOf(nonFinite));
          },
          py::arg("path"), py::arg("nonfinite"))
      .def(
          "_save_as_float",
          [](const Volume& v, const std::filesystem::path& path) {
            write(v, path, {.half = HalfMode::kOff});
          },
          py::arg("path"))
      .def_property_readonly(
          "background", [](const Volume& v) { return v.grid->volume.background; },
          "The value of voxels that are not active.")
      .def_property_readonly(
          "active_voxels", [](const Volume& v) { return activeVoxelCount(v.grid->volume); },
          "Number of active voxels.")
      .def_property_readonly(
          "nonfinite", [](const Volume& v) { return nonFiniteCount(v.grid->volume); },
          "Number of active voxels that are NaN or infinite.")
      .def_readonly("rounded_values", &Volume::roundedValues,
                    "Number of active voxels of from_numpy whose float32 differs from the element.")
      .def_property_readonly(
          "inactive_values", [](const Volume& v) { return v.grid->inactive.count(); },
          "Number of inactive voxels of the file, those of tiles included, whose values are not "
          "the\n"
          "background. A volume does not hold these values.")
      .def_property_readonly(
          "box", [](const Volume& v) { return plainBox(activeBox(v.grid->volume)); },
          "The first and the last active voxel along each axis; None if there is none.")
      .def_property_readonly(
          "value_range",
          [](const Volume& v) -> std::optional<std::pair<float, float>> {
            if (activeVoxelCount(v.grid->volume) == 0) return std::nullopt;
            const ValueRange range = activeRange(v.grid->volume);
            return std::pair(range.min, range.max);
          },
          "The smallest and the largest finite active value; None if there is none. Their "
          "difference is "
          "the\n"
          "range of which --max-error takes a percentage.")
      .def_property_readonly(
          "metadata", [](const Volume& v) { return dictOf(v.grid->descriptor.metadata); },
          "The grid's metadata that are texts, numbers, truth values or three numbers.")
      .def_property_readonly(
          "bytes", [](const Volume& v) { return bytesInMemory(v.grid->volume); },
          "Number of bytes of memory that the voxels take.");
}

}  // namespace esvr::python
