#pragma once
/// What solving for intensities asks of a device: passes over the bricks, from intensities to the
/// sum and back to ellipsoids. A is the matrix of phi, a row a voxel, a column an ellipsoid.

#include <memory>
#include <span>
#include <vector>

#include "esvr/device.h"
#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"
#include "field/voxel_rule.h"

namespace esvr {

/// What the sum is to be, and how it becomes voxels.
struct IntensityTarget {
  const SparseVolume& source;
  VoxelRule rule;
  Box box;                          ///< errors count here
  std::span<const Coord> bricks{};  ///< index corners of all bricks that can hold an active voxel
  bool restrictToBricks = false;    ///< else those of the source and those supports reach as well
};

/// Of the voxels that a reader gets, over the target's box.
struct StoredError {
  double squares = 0.0;  ///< sum
  double largest = 0.0;  ///< magnitude
};

/// Both in one order, whatever the number of threads.
struct IntensityGradient {
  std::vector<double> byIntensity;  ///< A^T r, r = V - target
  std::vector<double> curvature;    ///< sum phi^2
};

/// Intensities and directions are those of all chunks, one behind the other. Sums over a brick are
/// float32, beyond it float64, in a fixed order.
class IntensityPasses {
 public:
  virtual ~IntensityPasses() = default;

  /// All that follows is of this field's shapes and background; intensities do not matter.
  /// \throws RuntimeFailure  kappas of each ellipsoid, on a GPU
  virtual void setShapes(const Field& field) = 0;

  [[nodiscard]] virtual StoredError error(std::span<const float> intensities) = 0;

  /// Voxels that come back exactly, as those below the threshold do, have no residual, and take no
  /// part in applyNormal from then on.
  virtual StoredError gradient(std::span<const float> intensities, IntensityGradient& out) = 0;

  /// A^T A of a direction, over the voxels that the last gradient left.
  virtual void applyNormal(std::span<const double> direction, std::vector<double>& out) = 0;
};

/// \param target  must outlive the passes \throws DeviceError  the GPU cannot be used
[[nodiscard]] std::unique_ptr<IntensityPasses> makeIntensityPasses(const IntensityTarget& target,
                                                                   const Device& device);

/// Index corners of the bricks that are there whatever the field, in increasing order.
[[nodiscard]] std::vector<Coord> knownCorners(const IntensityTarget& target);

/// A brick's values in the source; null where it has none.
[[nodiscard]] const float* sourceValues(const SparseVolume& source, Coord corner);

}  // namespace esvr
