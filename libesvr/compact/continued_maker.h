#pragma once
/// Quantises the ellipsoids of a frame that continue those of the previous frame.

#include <cstdint>
#include <span>
#include <vector>

#include "compact/trial.h"
#include "esvr/container.h"

namespace esvr {

/// A fit of a frame that began with the ellipsoids of the previous frame.
struct ContinuedFit {
  const StoredGrid& grid;               ///< grid in float32; its field has one chunk
  std::span<const std::uint32_t> from;  ///< FitResult::startOf
  const StoredGrid& previous;           ///< grid of the previous frame; it has one quantised chunk
};

class ContinuedMaker {
 public:
  /// All that it is given must outlive the maker. \throws DeviceError  the GPU cannot be used
  ContinuedMaker(const ContinuedFit& fit, const TrialTarget& target);
  ContinuedMaker(const ContinuedMaker&) = delete;
  ContinuedMaker& operator=(const ContinuedMaker&) = delete;

  /// False if no ellipsoid continues one of the previous frame; there is no trial then.
  [[nodiscard]] bool anyContinues() const { return !continues_.empty(); }

  /// Makes the steps smaller than those of the previous frame by a number of octaves, at most
  /// codec::kMaxRefinement. \throws RuntimeFailure  a value lies outside the lattice
  void refine(int octaves);

  /// Chooses codes near the exact values, solves for the intensities with the chosen shapes, and
  /// chooses codes of these.
  /// \param bitPrice  as in ContinuedThrift
  /// \return the trial; its steps are not set
  /// \throws RuntimeFailure  a value lies outside the lattice of the previous frame
  [[nodiscard]] Trial make(double bitPrice);

 private:
  std::vector<Coord> bricks_;
  IntensityTarget target_;
  IntensityProblem problem_;
  const QuantisedEllipsoids& before_;
  std::vector<std::uint32_t> continues_;
  std::vector<std::uint8_t> precisions_;  ///< those of the ellipsoids that continue none
  Ellipsoids added_;                      ///< the same ellipsoids, in their first order
  Field field_;  ///< its ellipsoids have the order of the frame and the previous origin
  QuantisedEllipsoids fresh_;  ///< those that continue none
};

}  // namespace esvr
