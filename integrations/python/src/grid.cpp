// esvr.Grid and esvr.Ellipsoids.

#include <pybind11/stl.h>

#include <cmath>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "esvr/grid_names.h"
#include "python/src/interruptible.h"

namespace esvr::python {
namespace {

/// esvr.Ellipsoids: the ellipsoids of all chunks, as arrays.
struct Ellipsoids {
  py::array_t<double> mu;
  py::array_t<float> scale, quaternion, intensity, kappa;
  double epsilon = 0.0;  ///< the kernel's epsilon (kernel.h)
};

/// Copies the ellipsoids of a chunk to row `first` and those after it.
void copyChunk(const Chunk& chunk, float kappa, py::ssize_t first, Ellipsoids& to) {
  const auto& e = chunk.ellipsoids;
  const double origin[3] = {double(chunk.origin.x), double(chunk.origin.y), double(chunk.origin.z)};
  for (std::size_t i = 0; i < e.size(); ++i) {
    const auto row = first + py::ssize_t(i);
    for (int a = 0; a < 3; ++a) {
      to.mu.mutable_at(row, a) = origin[a] + double(e.center[a][i]);
      to.scale.mutable_at(row, a) = std::exp(e.logScale[a][i]);
    }
    for (int a = 0; a < 4; ++a) to.quaternion.mutable_at(row, a) = e.rotation[a][i];
    to.intensity.mutable_at(row) = e.intensity[i];
    to.kappa.mutable_at(row) = e.kappa.empty() ? kappa : e.kappa[i];
  }
}

/// The arrays refuse to be written: they are not the ellipsoids of the grid but show them.
template <class T>
void makeReadOnly(py::array_t<T>& array) {
  array.attr("setflags")(py::arg("write") = false);
}

Ellipsoids ellipsoidsOf(const Grid& self) {
  const Field& field = self.grid->field;
  const auto n = py::ssize_t(field.ellipsoidCount());
  Ellipsoids all{py::array_t<double>({n, py::ssize_t(3)}), py::array_t<float>({n, py::ssize_t(3)}),
                 py::array_t<float>({n, py::ssize_t(4)}), py::array_t<float>(n),
                 py::array_t<float>(n)};
  all.epsilon = field.kernel.epsilon;
  py::ssize_t first = 0;
  for (const Chunk& chunk : field.chunks) {
    copyChunk(chunk, field.kernel.kappa, first, all);
    first += py::ssize_t(chunk.ellipsoids.size());
  }
  makeReadOnly(all.mu);
  makeReadOnly(all.scale);
  makeReadOnly(all.quaternion);
  makeReadOnly(all.intensity);
  makeReadOnly(all.kappa);
  return all;
}

using Places = py::array_t<double, py::array::c_style | py::array::forcecast>;

py::array_t<float> evaluate(const Grid& self, const Places& points) {
  static_assert(sizeof(Place) == 3 * sizeof(double));
  if (points.ndim() != 2 || points.shape(1) != 3)
    throw UsageError("points must have the shape (n, 3)");
  const StoredGrid& grid = *self.grid;
  if (!followsFromEllipsoids(grid))
    throw UsageError(
        "grid '" + shownName(grid.descriptor.name) +
        "' stores voxels or a residual, so that there is no sum to evaluate; decode it "
        "with to_volume()");
  py::array_t<float> values(points.shape(0));
  const std::span places(reinterpret_cast<const Place*>(points.data()),
                         std::size_t(points.shape(0)));
  const std::span out(values.mutable_data(), places.size());
  interruptible([&] {
    evaluatePlaces(grid.field, places, out);
    if (const auto range = voxelRule(grid).range)
      for (float& value : out) value = std::clamp(value, range->min, range->max);
  });
  return values;
}

std::string kindOf(const StoredGrid& grid) {
  if (grid.voxels) return "voxels";
  return grid.residual ? "ellipsoids with a residual" : "ellipsoids";
}

std::string gridText(const Grid& self) {
  const StoredGrid& grid = *self.grid;
  const std::size_t ellipsoids = grid.field.ellipsoidCount();
  std::string text = "<esvr.Grid '" + shownName(grid.descriptor.name) + "': ";
  text += grid.voxels ? "voxels" : std::to_string(ellipsoids) + " ellipsoids";
  return text + ", " + std::to_string(grid.activeVoxels) + " active voxels>";
}

void addEllipsoids(py::module_& module) {
  py::class_<Ellipsoids>(
      module, "Ellipsoids",
      "The ellipsoids of a grid as arrays that cannot be written.\n\n"
      "An ellipsoid adds intensity * phi(m) with m = |S^-1 R^T (x - mu)|^2, where\n"
      "S is the diagonal matrix of its scale, R the matrix of its quaternion, and\n"
      "phi the kernel with the edge kappa.")
      .def_readonly("mu", &Ellipsoids::mu, "Centers, voxels: float64 of shape (n, 3).")
      .def_readonly("scale", &Ellipsoids::scale, "Scales, voxels: float32 of shape (n, 3).")
      .def_readonly("quaternion", &Ellipsoids::quaternion,
                    "Unit quaternions w, x, y, z: float32 of shape (n, 4).")
      .def_readonly("intensity", &Ellipsoids::intensity,
                    "Intensities in units of the values: float32 of shape (n,).")
      .def_readonly("kappa", &Ellipsoids::kappa, "Edges of the kernel: float32 of shape (n,).")
      .def_readonly("epsilon", &Ellipsoids::epsilon,
                    "The kernel ends where (1 + E) / (E + e^m) falls to it, with E = e^kappa.")
      .def("__len__", [](const Ellipsoids& e) { return e.intensity.size(); });
}

}  // namespace

py::object matrixOf(const Transform& transform) {
  if (!transform.affine) return py::none();
  constexpr py::ssize_t kSide = 4;
  py::array_t<double> matrix({kSide, kSide});
  for (py::ssize_t row = 0; row < kSide; ++row)  // the library's matrix is for row vectors
    for (py::ssize_t column = 0; column < kSide; ++column)
      matrix.mutable_at(row, column) = (*transform.affine)[std::size_t(kSide * column + row)];
  return matrix;
}

Volume decoded(const Grid& grid, const std::optional<PlainBox>& box,
               const std::optional<std::uint64_t>& maxMemory) {
  DecodeOptions options{.maxBytes = memoryLimit(maxMemory)};
  if (box) options.box = boxOf(*box);
  if (options.box && options.box->empty()) throw UsageError("the box is empty");
  return interruptible([&] {
    return Volume{std::make_shared<const VolumeGrid>(
        VolumeGrid{grid.grid->descriptor, decodeGrid(*grid.grid, options)})};
  });
}

void addGrid(py::module_& module) {
  addEllipsoids(module);
  py::class_<Grid>(module, "Grid", "A grid of an .esvr file: a sum of ellipsoids, or voxels.")
      .def("to_volume", &decoded, py::arg("box") = py::none(), py::kw_only(),
           py::arg("max_memory") = py::none(),
           "Decodes the voxels, or those in a box ((x0, y0, z0), (x1, y1, z1)), both inclusive.\n"
           "max_memory is that of esvr.read.")
      .def("evaluate", &evaluate, py::arg("points"),
           "The sum of the ellipsoids at points of shape (n, 3), in index coordinates: float32 of\n"
           "shape (n,). A fit constrains it at voxels only.")
      .def_property_readonly("ellipsoids", &ellipsoidsOf, "The ellipsoids (esvr.Ellipsoids).")
      .def_property_readonly(
          "ellipsoid_count", [](const Grid& g) { return g.grid->field.ellipsoidCount(); },
          "Number of ellipsoids; 0 if the grid stores voxels.")
      .def_property_readonly("name", [](const Grid& g) { return g.grid->descriptor.name; })
      .def_property_readonly(
          "grid_class", [](const Grid& g) { return className(g.grid->descriptor.gridClass); },
          "\"fog volume\", \"level set\", \"staggered\" or \"unknown\".")
      .def_property_readonly(
          "kind", [](const Grid& g) { return kindOf(*g.grid); },
          "\"ellipsoids\", \"ellipsoids with a residual\" or \"voxels\".")
      .def_property_readonly("background",
                             [](const Grid& g) { return float(g.grid->descriptor.background); })
      .def_property_readonly(
          "active_voxels", [](const Grid& g) { return g.grid->activeVoxels; },
          "Number of active voxels of the source.")
      .def_property_readonly(
          "box", [](const Grid& g) { return plainBox(g.grid->activeBox); },
          "The first and the last active voxel of the source along each axis.")
      .def_property_readonly(
          "value_range",
          [](const Grid& g) { return std::pair(g.grid->valueMin, g.grid->valueMax); },
          "The smallest and the largest active value of the source.")
      .def_property_readonly(
          "transform", [](const Grid& g) { return matrixOf(g.grid->descriptor.transform); },
          "4 x 4 matrix from index to world coordinates, for column vectors; None for a frustum.")
      .def_property_readonly(
          "bytes", [](const Grid& g) { return bytesAdded(*g.grid); },
          "Largest number of bytes that the grid adds to a file.")
      .def("__repr__", &gridText);
}

}  // namespace esvr::python
