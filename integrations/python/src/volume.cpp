// esvr.Volume.

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "esvr/error.h"
#include "esvr/grid_names.h"
#include "python/src/interruptible.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;

/// Voxels of an array of Python, with z fastest.
struct Dense {
  const float* values;
  Coord side, origin;

  [[nodiscard]] Box box() const { return {origin, origin + side - Coord{1, 1, 1}}; }
  [[nodiscard]] float at(Coord voxel) const {
    const Coord v = voxel - origin;
    return values[(std::size_t(v.x) * side.y + v.y) * side.z + v.z];
  }
};

Dense denseOf(const FloatArray& array, const Corner& origin) {
  if (array.ndim() != 3)
    throw UsageError("the array has " + std::to_string(array.ndim()) +
                     " axes, and a volume has 3: x, y, z");
  for (int a = 0; a < 3; ++a) {
    const double last = double(origin[a]) + double(array.shape(a)) - 1.0;
    if (array.shape(a) == 0) throw UsageError("the array has no voxels");
    if (last > Box::kMax) throw UsageError("the array ends outside the index space");
  }
  const auto side = [&](int a) { return std::int32_t(array.shape(a)); };
  return {array.data(), {side(0), side(1), side(2)}, coordOf(origin)};
}

/// A voxel of the array is active if it differs from the background by more than the threshold.
BrickInput brickOfArray(const Dense& dense, Coord corner, float background, float threshold) {
  BrickInput brick{corner, {}, {}};
  brick.values.fill(background);
  for (int i = 0; i < kBrickVoxels; ++i) {
    const Coord voxel = corner + voxelLocal(i);
    if (!dense.box().contains(voxel)) continue;
    const float value = dense.at(voxel);
    if (!std::isfinite(value))
      throw BadInput("the value of voxel " + toString(voxel) + " is not finite");
    if (!(std::abs(value - background) > threshold)) continue;
    brick.values[i] = value;
    brick.active.set(i);
  }
  return brick;
}

std::vector<BrickInput> bricksOf(const Dense& dense, float background, float threshold) {
  const Coord first = brickOf(dense.box().min), last = brickOf(dense.box().max);
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
  double voxelSize;
  std::string name;
  bool levelSet;
};

Volume fromNumpy(const FloatArray& array, const ArrayOptions& options) {
  if (!std::isfinite(options.background)) throw UsageError("background must be finite");
  if (!(options.threshold >= 0.0f)) throw UsageError("threshold must be 0 or above");
  if (!(options.voxelSize > 0.0) || !std::isfinite(options.voxelSize))
    throw UsageError("voxel_size must be finite and above 0");
  const Dense dense = denseOf(array, options.origin);
  const py::gil_scoped_release release;
  auto grid = std::make_shared<VolumeGrid>();
  grid->descriptor.name = options.name;
  grid->descriptor.gridClass = options.levelSet ? GridClass::kLevelSet : GridClass::kFogVolume;
  grid->descriptor.background = options.background;
  grid->descriptor.transform = uniformTransform(options.voxelSize);
  grid->volume =
      makeVolume(bricksOf(dense, options.background, options.threshold), options.background);
  return {std::move(grid)};
}

Box boxOrActive(const SparseVolume& volume, const std::optional<PlainBox>& box) {
  const Box chosen = box ? boxOf(*box) : activeBox(volume);
  if (chosen.empty())
    throw UsageError(box ? "the box is empty" : "the volume has no active voxel; name a box");
  return chosen;
}

py::array_t<float> toNumpy(const Volume& self, const std::optional<PlainBox>& plain) {
  const SparseVolume& volume = self.grid->volume;
  const Box box = boxOrActive(volume, plain);
  const auto length = [&](std::int32_t low, std::int32_t high) {
    return py::ssize_t(high) - low + 1;
  };
  py::array_t<float> array(
      {length(box.min.x, box.max.x), length(box.min.y, box.max.y), length(box.min.z, box.max.z)});
  float* values = array.mutable_data();
  const py::ssize_t ny = array.shape(1), nz = array.shape(2), size = array.size();
  const py::gil_scoped_release release;
  std::fill(values, values + size, volume.background);
  tbb::parallel_for(std::size_t(0), volume.brickCount(), [&](std::size_t b) {
    const Coord corner = volume.brickCorner(b);
    const auto from = volume.brickValues(b);
    for (int i = 0; i < kBrickVoxels; ++i) {
      const Coord voxel = corner + voxelLocal(i);
      if (!box.contains(voxel)) continue;
      const Coord v = voxel - box.min;
      values[(v.x * ny + v.y) * nz + v.z] = from[i];
    }
  });
  return array;
}

/// The unique name, which may be empty, of the first grid that a fit can take.
std::string firstOfNumbers(const std::filesystem::path& path) {
  const VdbSummary summary = inspectVdb(path);
  const auto& grids = summary.grids;
  const auto first = std::find_if(grids.begin(), grids.end(),
                                  [](const GridSummary& g) { return g.skipReason.empty(); });
  if (first == grids.end())
    throw BadInput(path.string() + ": no grid of numbers has an active voxel");
  return first->uniqueName;
}

Volume fromVdb(const std::filesystem::path& path, const std::optional<std::string>& name) {
  return interruptible([&] {
    return Volume{
        std::make_shared<const VolumeGrid>(readGrid(path, name ? *name : firstOfNumbers(path)))};
  });
}

/// The only grid of a file, which may have no active voxel.
Volume fromOnlyGrid(const std::filesystem::path& path) {
  return interruptible([&] {
    const std::string name = inspectVdb(path).grids.at(0).uniqueName;
    return Volume{std::make_shared<const VolumeGrid>(readGrid(path, name, {.allowEmpty = true}))};
  });
}

void write(const Volume& self, const std::filesystem::path& path, const WriteOptions& options) {
  interruptible([&] {
    const GridToWrite grid = self.grid.get();
    writeGrids(path, {}, std::span(&grid, 1), options);
  });
}

}  // namespace

void addVolume(py::module_& module) {
  py::class_<Volume>(module, "Volume",
                     "A sparse volume: voxels that are active, and a background elsewhere.")
      .def_static(
          "from_numpy",
          [](const FloatArray& array, float background, const Corner& origin, float threshold,
             double voxelSize, const std::string& name, bool levelSet) {
            return fromNumpy(array, {background, threshold, origin, voxelSize, name, levelSet});
          },
          py::arg("array"), py::kw_only(), py::arg("background") = 0.0f,
          py::arg("origin") = Corner{}, py::arg("threshold") = 0.0f, py::arg("voxel_size") = 1.0,
          py::arg("name") = "density", py::arg("level_set") = false,
          "Makes a volume from an array of shape (nx, ny, nz), converted to float32.\n\n"
          "A voxel is active if it differs from the background by more than the threshold.\n"
          "origin is the voxel of array[0, 0, 0], and voxel_size is in world units.")
      .def_static("from_vdb", &fromVdb, py::arg("path"), py::arg("grid") = py::none(),
                  "Reads a grid of numbers of a .vdb or .nvdb file; the first one by default.")
      .def("to_numpy", &toNumpy, py::arg("box") = py::none(),
           "The voxels of a box ((x0, y0, z0), (x1, y1, z1)), both inclusive, as float32 of shape\n"
           "(nx, ny, nz); by default those of Volume.box.")
      .def(
          "save",
          [](const Volume& v, const std::filesystem::path& path, bool overwrite) {
            write(v, path, {.overwrite = overwrite});
          },
          py::arg("path"), py::kw_only(), py::arg("overwrite") = false,
          "Writes a .vdb or .nvdb file with this grid.")
      // For esvr/_openvdb.py.
      .def_static("_from_only_grid", &fromOnlyGrid, py::arg("path"))
      .def(
          "_save_as_float",
          [](const Volume& v, const std::filesystem::path& path) {
            write(v, path, {.half = HalfMode::kOff});
          },
          py::arg("path"))
      .def_property_readonly("name", [](const Volume& v) { return v.grid->descriptor.name; })
      .def_property_readonly(
          "grid_class", [](const Volume& v) { return className(v.grid->descriptor.gridClass); },
          "\"fog volume\", \"level set\", \"staggered\" or \"unknown\".")
      .def_property_readonly("background",
                             [](const Volume& v) { return v.grid->volume.background; })
      .def_property_readonly(
          "active_voxels", [](const Volume& v) { return activeVoxelCount(v.grid->volume); },
          "Number of active voxels.")
      .def_property_readonly(
          "box", [](const Volume& v) { return plainBox(activeBox(v.grid->volume)); },
          "The first and the last active voxel along each axis; None if there is none.")
      .def_property_readonly(
          "transform", [](const Volume& v) { return matrixOf(v.grid->descriptor.transform); },
          "4 x 4 matrix from index to world coordinates, for column vectors; None for a frustum.");
}

}  // namespace esvr::python
