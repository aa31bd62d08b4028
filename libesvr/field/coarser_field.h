#pragma once
/// Sums of ellipsoids in voxels that are 2^l times as long, which are the levels of detail of a field. A
/// coarser voxel is to be the mean of the finer ones in its space. That mean is a filter, and cumulants
/// add up under a filter: an ellipsoid becomes one with wider scales, a lower intensity and softer edges.
/// So no finer voxel is evaluated. docs/math.md, "Levels of detail", has the formulas and what they leave
/// out.

#include "esvr/ellipsoids.h"
#include "esvr/field.h"
#include "esvr/volume.h"

namespace esvr {

/// The moments of a kernel whose scales are 1, as a distribution of places. They are computed by
/// quadrature, with an error below 2 % for the sharpest edges, and below 1e-4 for kappa up to 10.
struct PlaceMoments {
  double mass;  ///< integral of phi r^2 over the distance r; that over space is 4 pi times as much
  double variance;  ///< along each axis
  double kurtosis;  ///< mean of r^4 in units of variance^2: 15 for a Gaussian, less with edges
};
[[nodiscard]] PlaceMoments momentsOf(const KernelConstants<double>& kernel);

/// The field in the index space of a level: its voxel v has the place of the middle of the 2^level
/// voxels from 2^level v on, along each axis. Sums of level 0 are the field itself.
/// \param level  0 to 30
[[nodiscard]] Field coarserField(const Field& field, int level);

/// Whether the voxels of a rule have levels that are sums. If bricks or masks say which voxels there are,
/// or inactive voxels have signs, coarser voxels are means of the finer ones instead. The same holds where values lie on
/// both sides of the background: they cancel each other in a coarser voxel, which a threshold would take for empty.
[[nodiscard]] bool hasCoarserFields(const Field& field, const RevoxeliseOptions& voxels);

/// The rule by which the sums of a level become its voxels; apart from shareWithin().
/// \param voxels  of level 0; hasCoarserFields()
[[nodiscard]] RevoxeliseOptions coarserRule(const RevoxeliseOptions& voxels, int level);

/// The bricks (increasing index corners, in voxels of the level) of a coarser field that may have a voxel
/// other than the background, and all around the places where the finer levels have one.
/// \throws MemoryExceeded  as for reachedBricks
[[nodiscard]] std::vector<Coord> coarserReach(const Field& coarser, const Box& within);

/// The share of a coarser voxel's space that lies in a box of voxels of level 0. All outside the box is
/// background, with which a voxel at its border is mixed by this share.
[[nodiscard]] ESVR_HD inline float shareWithin(const Box& box, int level, const Coord& voxel) {
  const auto along = [level](std::int32_t low, std::int32_t high, std::int32_t at) {
    const std::int64_t all = std::int64_t{1} << level, first = at * all, last = first + all - 1;
    const std::int64_t from = first < low ? low : first, to = high < last ? high : last;
    const std::int64_t inside = to - from + 1;
    return inside <= 0 ? 0.0f : (inside < all ? float(inside) / float(all) : 1.0f);
  };
  return along(box.min.x, box.max.x, voxel.x) * along(box.min.y, box.max.y, voxel.y) *
         along(box.min.z, box.max.z, voxel.z);
}

}  // namespace esvr
