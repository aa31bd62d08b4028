#pragma once
/// Errors of a grid of vectors against a reference.

#include <array>

#include "esvr/metrics.h"
#include "esvr/vector_grid.h"

namespace esvr {

/// All PSNR of a grid of vectors have the same peak: by default that of its vectors, peakOfVectors.
/// A component that is small everywhere therefore has a high PSNR if its error is small against the
/// longest vector.
struct VectorMetrics {
  VolumeMetrics magnitude;  ///< of the lengths of the vectors
  std::array<VolumeMetrics, kComponents> components;
};

/// The length of the longest active vector, or 1 if all are zero. It does not depend on the
/// direction of the axes.
/// \throws BadInput  there is no active voxel
[[nodiscard]] double peakOfVectors(const VectorVolume& reference);

/// The range to which a bound on the errors of all components refers, such as 1 %: the largest
/// valueRangeOf() of a component. A component that hardly changes is thus not stored more precisely
/// than the others.
/// \throws BadInput  there is no active voxel
[[nodiscard]] double valueRangeOfVectors(const VectorVolume& reference);

/// Compares vectors by compareVolumes. A voxel of a grid of vectors is active if it is active in
/// any component.
/// \param options  the default of the peak is peakOfVectors(reference)
/// \throws BadInput, UsageError  as for compareVolumes
[[nodiscard]] VectorMetrics compareVectors(const VectorVolume& reference,
                                           const VectorVolume& candidate,
                                           const CompareOptions& options = {});

}  // namespace esvr
