#pragma once
/// Names of the enumerations that files hold, what tells grids of one name apart, and bytes of grids.

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/ellipsoids.h"
#include "esvr/grid.h"
#include "esvr/vdb_io.h"

namespace esvr::cli {

/// "float", "half" or "double".
[[nodiscard]] std::string nameOf(ValueType type);
/// "continuous" or "paper".
[[nodiscard]] std::string nameOf(KernelForm form);
/// "threshold", "bricks" or "mask".
[[nodiscard]] std::string nameOf(TopologyKind kind);

/// How the active voxels of a grid of ellipsoids are found: "threshold 0.01" or "a mask".
[[nodiscard]] std::string activityOf(const StoredGrid& grid);

/// The voxels of a grid that are not finite: "12 NaN and 1 -infinity voxels".
[[nodiscard]] std::string textOf(const NonFiniteCounts& counts);

/// The type of the values of a grid of a .vdb file: "int32", "vec3s as half".
[[nodiscard]] std::string valuesOf(const GridSummary& grid);
/// The number of its active voxels; "-" if the grid is of a type that is not counted, and the
/// writer did not store the number.
[[nodiscard]] std::string activeVoxelsOf(const GridSummary& grid);

/// What tells the grids of a file apart from others of their names (pairGrids), in the order of the file.
[[nodiscard]] std::vector<GridTraits> traitsOf(const VdbSummary& file);
[[nodiscard]] std::vector<GridTraits> traitsOf(const EsvrFile& file);

/// Adds the ranges of values that are not known where they are needed, because another file has another
/// number of grids of a name.
/// \param rangeOf  reads the range of the grid at a place; nothing if it has none
void addRanges(std::span<const GridTraits> other,
               const std::function<std::optional<std::array<float, 2>>(std::size_t)>& rangeOf,
               std::vector<GridTraits>& traits);

/// Bytes of the sections that count.
[[nodiscard]] std::uint64_t bytesIf(const EsvrSummary& file,
                                    const std::function<bool(const SectionSummary&)>& counts);
/// Bytes of the sections of a grid, whether it shares them with other grids or not.
[[nodiscard]] std::uint64_t storedBytes(const EsvrSummary& file, std::size_t grid);
/// Bytes of the sections of a grid without those that an earlier section has too. The sum over the
/// grids of a file counts every byte once.
[[nodiscard]] std::uint64_t ownBytes(const EsvrSummary& file, std::size_t grid);

}  // namespace esvr::cli
