#pragma once
/// What the classes of the Python module hold, and long calls that Ctrl-C ends.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/error.h"
#include "esvr/vdb_io.h"

namespace esvr::python {

namespace py = pybind11;

/// esvr.Volume: voxels and the other properties of their grid. It does not change after it was
/// made.
struct Volume {
  std::shared_ptr<const VolumeGrid> grid;
  std::uint64_t roundedValues = 0;  ///< active voxels whose number was rounded to a float
};

/// The voxels of a level set with the signs that say where its inside is.
struct SignedVoxels {
  explicit SignedVoxels(SparseVolume source) : volume(std::move(source)), signs(volume) {}

  SparseVolume volume;
  EmptySigns signs;
};

/// esvr.PackedGrid. It does not change after it was made.
struct Packed {
  std::shared_ptr<const PackedGrid> grid;
  std::shared_ptr<const SignedVoxels> levelSet{};  ///< null for grids of other classes
};

/// esvr.File: the content of an .esvr file.
struct File {
  std::shared_ptr<const EsvrFile> file;
};

/// esvr.Grid: a grid of a file, or of a fit. Those of one file share its memory.
struct Grid {
  std::shared_ptr<const StoredGrid> grid;
};

/// The limit that a caller gives, or the usual one.
[[nodiscard]] inline std::uint64_t memoryLimit(const std::optional<std::uint64_t>& given) {
  return given ? *given : usualMemoryLimit();
}

/// esvr.Ellipsoids: the ellipsoids of all chunks, as arrays.
struct Ellipsoids {
  py::array_t<double> mu;
  py::array_t<float> scale, quaternion, intensity, kappa;
  double epsilon = 0.0;  ///< the kernel's epsilon (ellipsoids.h)
};

/// A box of voxels as Python has it: its first and its last voxel.
using Corner = std::array<std::int32_t, 3>;
using PlainBox = std::array<Corner, 2>;

[[nodiscard]] inline Coord coordOf(const Corner& c) { return {c[0], c[1], c[2]}; }
[[nodiscard]] inline Box boxOf(const PlainBox& b) { return {coordOf(b[0]), coordOf(b[1])}; }
/// None for an empty box.
[[nodiscard]] inline std::optional<PlainBox> plainBox(const Box& b) {
  if (b.empty()) return std::nullopt;
  return PlainBox{{{b.min.x, b.min.y, b.min.z}, {b.max.x, b.max.y, b.max.z}}};
}

/// Metadata as a dictionary of Python, and the other way (properties.cpp). Items of types that Python has not are
/// left out of the dictionary.
[[nodiscard]] py::dict dictOf(const std::vector<MetaItem>& items);
/// \throws UsageError  a value is of another type than those of OpenVDB's metadata
[[nodiscard]] std::vector<MetaItem> itemsOf(const py::dict& metadata);

/// A matrix from index to world coordinates, for column vectors; the library's is for row vectors.
using Matrix = std::array<std::array<double, 4>, 4>;
/// \throws UsageError  the matrix is singular
[[nodiscard]] Transform transformFrom(const Matrix& matrix);
/// \throws UsageError  no class has the name
[[nodiscard]] GridClass classFrom(const std::string& name);

/// What repr() says of an object (properties.cpp).
[[nodiscard]] std::string describe(const Volume& volume);
[[nodiscard]] std::string describe(const Grid& grid);
[[nodiscard]] std::string describe(const Packed& grid);
[[nodiscard]] std::string describe(const File& file);

/// Bytes of memory that the voxels of a volume take.
[[nodiscard]] std::uint64_t bytesInMemory(const SparseVolume& volume);

/// The matrix from index to world coordinates, for column vectors; None for a frustum.
[[nodiscard]] py::object matrixOf(const Transform& transform);

/// Adds what Volume, PackedGrid and Grid have of the descriptors of their grids, and what repr() says of them.
template <class T>
void addDescriptor(py::class_<T>& type) {
  type.def_property_readonly(
          "name", [](const T& object) { return object.grid->descriptor.name; },
          "The name of the grid, which other grids of its file may have, too.")
      .def_property_readonly(
          "grid_class",
          [](const T& object) { return className(object.grid->descriptor.gridClass); },
          "\"fog volume\", \"level set\", \"staggered\" or \"unknown\".")
      .def_property_readonly(
          "transform", [](const T& object) { return matrixOf(object.grid->descriptor.transform); },
          "4 x 4 matrix from index to world coordinates, for column vectors; None for a frustum.")
      .def("__repr__", [](const T& object) { return describe(object); });
}

/// The stack level of warnings: the caller of the function that explains wrong arguments (esvr/_keywords.py).
inline constexpr py::ssize_t kCaller = 2;

/// \throws MemoryExceeded  an array over the box would have more bytes than there are addresses
void requireAddressable(const Box& box, std::size_t bytesOfElement);

/// What the argument `nonfinite` says. \throws UsageError  it is neither 'refuse' nor 'keep'
[[nodiscard]] NonFinite nonFiniteOf(const std::string& word);

/// The arguments `coarsen`, which is one of esvr2vdb --coarsen, and `voxel_size`.
struct SavedResolution {
  int coarsen = 1;
  bool isAuto = false;  ///< the least factor with which the grids fit into the memory
  std::optional<double> voxelSize{};
};
/// \throws UsageError  an argument is out of range, or both are given
[[nodiscard]] SavedResolution resolutionOf(const py::object& coarsen,
                                           const std::optional<double>& voxelSize);
/// Decodes with a resolution. \param decode  takes a SavedResolution that is not `isAuto`, and throws MemoryExceeded
template <class Decode>
auto atResolution(const SavedResolution& wish, const Decode& decode) {
  if (!wish.isAuto) return decode(wish);
  for (const int factor : {1, 2, 4}) try {
      return decode({.coarsen = factor});
    } catch (const MemoryExceeded&) {
      continue;  // coarser voxels take less
    }
  return decode({.coarsen = 8});
}
/// The factor of esvr/resolution.h. \throws UsageError  as for factorFor
[[nodiscard]] double factorOf(const Transform& transform, const SavedResolution& wish);

/// The voxels of a stored grid, with the GIL released.
/// \throws UsageError  the box is empty; as for factorOf
/// \throws MemoryExceeded  they need more than the limit
[[nodiscard]] Volume decoded(const Grid& grid, const std::optional<PlainBox>& box,
                             const std::optional<std::uint64_t>& maxMemory = std::nullopt,
                             const SavedResolution& resolution = {});

/// Waits for a call on another thread with the GIL released. A signal that Python turns into an
/// exception sets the token; the exception is thrown when the call has ended.
template <class Result>
Result waitFor(std::future<Result>& call, CancelToken& token) {
  constexpr std::chrono::milliseconds kPoll{50};
  std::optional<py::error_already_set> raised;
  while (true) {
    {
      const py::gil_scoped_release release;
      if (call.wait_for(kPoll) == std::future_status::ready) break;
    }
    if (raised || PyErr_CheckSignals() == 0) continue;
    raised.emplace();
    token.cancel();
  }
  if (raised) {
    const py::gil_scoped_release release;
    call.wait();
  }
  if (raised) throw std::move(*raised);
  return call.get();
}

/// Runs a call that takes long on another thread. The loops of the library look at the token.
/// The call therefore ends soon after Ctrl-C.
/// \param call  takes a CancelToken& or nothing; it must not use objects of Python
template <class Call>
auto interruptible(const Call& call) {
  CancelToken token;
  auto running = std::async(std::launch::async, [&] {
    const CancelScope scope(&token);
    if constexpr (std::is_invocable_v<Call, CancelToken&>)
      return call(token);
    else
      return call();
  });
  return waitFor(running, token);
}

// Each adds its functions and classes to the module.
void addVolume(py::module_& module);
void addPacked(py::module_& module);
void addGrid(py::module_& module);
void addFiles(py::module_& module);
void addFit(py::module_& module);
void addRender(py::module_& module);
void addSplats(py::module_& module);
/// Lets the objects of the classes above be pickled and copied.
void addPickling(py::module_& module);

}  // namespace esvr::python
