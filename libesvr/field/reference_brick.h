#pragma once
/// The sum of ellipsoids on a brick in float64, by its definition, and what its evaluation in float32
/// may do.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"
#include "esvr/stability.h"

namespace esvr {

/// The terms of V - background at a voxel.
struct VoxelTerms {
  double sum = 0.0, magnitudes = 0.0;  ///< the sum of the terms, and of their magnitudes
  double errors = 0.0;                 ///< bound of the sum of their errors
  std::uint32_t count = 0;             ///< ellipsoids whose support contains the voxel
};

struct ReferenceBrick {
  std::array<VoxelTerms, kBrickVoxels> voxels;  ///< in voxelOffset order
  std::uint32_t ellipsoids = 0;                 ///< whose bounding box meets the brick
  double largestIntensity = 0.0;                ///< magnitude, of these ellipsoids
};

/// A field that is evaluated in float64. Its chunks must outlive it.
class ReferenceField {
 public:
  explicit ReferenceField(const Field& field);

  /// \param corner  index corner of a brick
  [[nodiscard]] ReferenceBrick evaluate(Coord corner) const;

  /// Bound of the difference of V in float32 at a voxel from its value in float64.
  [[nodiscard]] double bound(const ReferenceBrick& brick, int voxel,
                             const Arithmetic& arithmetic) const;

 private:
  const Field& field_;
  std::vector<Box> boxes_;  ///< bounding boxes of the supports, index coordinates
};

}  // namespace esvr
