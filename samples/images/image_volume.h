#pragma once
/// Converts a dense image to a sparse volume.

#include <cstdint>
#include <optional>

#include "esvr/sparse_volume.h"
#include "generators/sample_options.h"
#include "images/image_source.h"

namespace esvr::samples {

struct ImageOptions {
  /// Threshold in the image's units: voxels with value >= threshold are active. Without it, voxels
  /// with value != background are active.
  std::optional<double> threshold{};
  double background = 0.0;  ///< value of inactive voxels, in the image's units
  /// Whether values are divided by the largest value of an integer type, or by the largest |value|
  /// of other types.
  bool normalise = false;
  bool zeroNonFinite = false;  ///< NaN and infinite voxels become 0 instead of an error
};

struct ImageVolume {
  SparseVolume volume;
  std::uint64_t nonFiniteReplaced = 0;
};

/// Converts an image slab by slab; the memory is proportional to the active bricks, not to the
/// image.
/// \throws BadInput  voxels are not finite (the text gives the first one and their number), or the
///                   image cannot be normalised
[[nodiscard]] ImageVolume volumeOf(ImageSource& image, const ImageOptions& options,
                                   const Limits& limits);

}  // namespace esvr::samples
