#pragma once
/// Converts the fit's ellipsoids to a Field.

#include <span>

#include "esvr/ellipsoids.h"
#include "fit/ellipsoid.h"

namespace esvr {

struct ExportFrame {
  Coord origin;        ///< origin of the volume, index coordinates
  double scale = 1.0;  ///< see FitTarget::scale
  float background = 0.0f;
  Kernel kernel;
  std::span<const double> kappas{};  ///< kappa of each ellipsoid; empty if all share the kernel's
};

/// Computes principal axes, log scales and intensities in the grid's units, and sorts the
/// ellipsoids into chunks of kChunkExtent.
[[nodiscard]] Field exportField(std::span<const Ellipsoid> ellipsoids, const ExportFrame& frame);

}  // namespace esvr
