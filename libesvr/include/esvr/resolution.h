#pragma once
/// Decodes stored grids at another resolution: coarser ones as averages of the voxels of each coarse voxel, finer ones by
/// evaluating ellipsoids between the voxels of the source.
///
/// A factor r of the edge of a voxel turns the index coordinate x of the source into (x - (r - 1) / 2) / r, since the
/// coarse voxel c covers the space of the voxels from r c to r (c + 1), whose centers are at r c to r (c + 1) - 1. For
/// whole numbers, coarse voxel c covers r^3 voxels.

#include <array>
#include <cstdint>
#include <string>

#include "esvr/container.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "esvr/vdb_io.h"
#include "esvr/volume.h"

namespace esvr {

/// The factors that are possible.
inline constexpr double kFinestFactor = 1.0 / 64.0, kCoarsestFactor = 1024.0;

/// The transform of a grid whose voxels have edges that are `factor` times as long.
/// \throws UsageError  the factor is out of range; the map is not affine (a frustum), and the factor is not 1
[[nodiscard]] Transform transformAt(const Transform& transform, double factor);

/// The factor with which the shortest edge of a voxel gets a length.
/// \param voxelSize  above 0, units of the world
/// \throws UsageError  the map is not affine, or the factor is out of range
[[nodiscard]] double factorFor(const Transform& transform, double voxelSize);

/// The voxels of decodeGrid() at another resolution.
///
/// Factors above 1: a voxel is the average of the decoded values over its space, that is, a box filter of its own size;
/// voxels that are only partly in it count with their parts. Inactive voxels count with the background, unless this is
/// far from the values (spanOf, volume.h): then only active ones count. Voxels that are NaN or infinite do not count, and
/// where no other voxel is in the space of a coarse one, it is NaN. A coarse voxel is active if an active voxel is in its
/// space. A level set stays one: distances are averaged with the background on the outside and its negative inside. The
/// memory is that of the result and of a few thousand bricks, but for level sets, which are decoded as a whole.
///
/// Factors below 1: the sum of ellipsoids is evaluated at the centers of the finer voxels, and voxels are active by the
/// threshold of the grid.
/// \param options  the box is in voxels of the source; `maxBytes` is a limit on the result and what it takes to make it
/// \throws UsageError  as for transformAt and decodeGrid; a factor below 1, and the grid has not only ellipsoids with a
///                     threshold (the text names the grid)
/// \throws MemoryExceeded  it takes more than options.maxBytes
[[nodiscard]] VolumeGrid decodeAtResolution(const StoredGrid& grid, double factor,
                                            const DecodeOptions& options = {});

/// The vectors of three components. \throws  as for decodeAtResolution
[[nodiscard]] VectorGrid decodeVectorAtResolution(const std::string& name,
                                                  StoredComponents components, double factor,
                                                  const DecodeOptions& options = {});

/// The averages of a volume over voxels of `factor`^3 of its own, by the rules of decodeAtResolution() for grids that are
/// no level sets, with a background near the values. \param factor  1 or above
[[nodiscard]] SparseVolume coarsened(const SparseVolume& volume, int factor);

/// The ellipsoids of a field among voxels whose edges are `factor` times as long. Below 1, there are more voxels.
[[nodiscard]] Field amongOtherVoxels(Field field, double factor);

/// The file with exact voxels in place of the carried grids of numbers and vectors, which have other resolutions, too. Carried
/// grids of other types, without an active voxel, with voxels that are not finite or with a map that is not affine stay
/// carried.
/// \param read  limits of the memory
/// \throws BadInput, MemoryExceeded  as for readGrid (vdb_io.h)
[[nodiscard]] EsvrFile withCarriedAsVoxels(const EsvrFile& file, const ReadOptions& read = {});

/// Bytes of memory that decodeAtResolution() takes at most, but for level sets.
struct ResolutionBytes {
  std::uint64_t result = 0, work = 0;  ///< of the volume, and besides it while it is made
};
/// \param factor  1 or above. Nothing is evaluated.
[[nodiscard]] ResolutionBytes bytesAtResolution(const StoredGrid& grid, double factor,
                                                const DecodeOptions& options = {});

}  // namespace esvr
