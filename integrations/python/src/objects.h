#pragma once
/// What the classes of the Python module hold.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/memory_limit.h"
#include "esvr/vdb_io.h"

namespace esvr::python {

namespace py = pybind11;

/// esvr.Volume: voxels and the other properties of their grid. It does not change after it was made.
struct Volume {
  std::shared_ptr<const VolumeGrid> grid;
  std::uint64_t roundedValues = 0;  ///< active voxels whose number was rounded to a float
};

/// esvr.File: the content of an .esvr file.
struct File {
  std::shared_ptr<const EsvrFile> file;
};

/// esvr.Grid: a grid of a file, or of a fit. Those of one file share its memory.
struct Grid {
  std::shared_ptr<const StoredGrid> grid;
};

using Corner = std::array<std::int32_t, 3>;
/// The limit that a caller gives, or the usual one.
[[nodiscard]] inline std::uint64_t memoryLimit(const std::optional<std::uint64_t>& given) {
  return given ? *given : usualMemoryLimit();
}

/// A box of voxels as Python has it: its first and its last voxel.
using PlainBox = std::array<Corner, 2>;

[[nodiscard]] inline Coord coordOf(const Corner& c) { return {c[0], c[1], c[2]}; }
[[nodiscard]] inline Box boxOf(const PlainBox& b) { return {coordOf(b[0]), coordOf(b[1])}; }
/// None for an empty box.
[[nodiscard]] inline std::optional<PlainBox> plainBox(const Box& b) {
  if (b.empty()) return std::nullopt;
  return PlainBox{{{b.min.x, b.min.y, b.min.z}, {b.max.x, b.max.y, b.max.z}}};
}

/// A part of the content of a file that is saved as VDB.
struct SavedPart {
  std::optional<PlainBox> box;
  std::optional<std::size_t> layers, maxEllipsoids;

  [[nodiscard]] bool isWhole() const { return !box && !layers && !maxEllipsoids; }
};

/// Writes the voxels of all grids of a file to a .vdb or .nvdb file.
/// \return the names of the carried grids that were left out because they cannot be cut
/// \throws UsageError  the box is empty, or a number is 0
/// \throws BadInput  all grids would be left out
std::vector<std::string> saveFile(const File& file, const std::filesystem::path& path,
                                  const SavedPart& part, bool overwrite);

/// The matrix from index to world coordinates, for column vectors; None for a frustum.
[[nodiscard]] py::object matrixOf(const Transform& transform);

/// The voxels of a stored grid, with the GIL released.
/// \throws UsageError  the box is empty
/// \throws MemoryExceeded  they need more than the limit
[[nodiscard]] Volume decoded(const Grid& grid, const std::optional<PlainBox>& box,
                             const std::optional<std::uint64_t>& maxMemory = std::nullopt);

// Each adds its functions and classes to the module.
void addErrors(py::module_& module);
void addVolume(py::module_& module);
void addPacked(py::module_& module);
void addGrid(py::module_& module);
void addFiles(py::module_& module);
void addFit(py::module_& module);
void addRender(py::module_& module);
void addCompare(py::module_& module);

}  // namespace esvr::python
