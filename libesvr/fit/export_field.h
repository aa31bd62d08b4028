#pragma once
/// From the fit's own form to what files store.

#include <span>

#include "esvr/ellipsoids.h"
#include "fit/ellipsoid.h"

namespace esvr {

struct ExportFrame {
  Coord origin;        ///< of the volume, index coordinates
  double scale = 1.0;  ///< FitTarget::scale
  float background = 0.0f;
  Kernel kernel;
  std::span<const double> kappas{};  ///< of the ellipsoids, where they differ
};

/// Principal axes, log scales and intensities in the grid's units; chunks of kChunkExtent.
[[nodiscard]] Field exportField(std::span<const Ellipsoid> ellipsoids, const ExportFrame& frame);

}  // namespace esvr
