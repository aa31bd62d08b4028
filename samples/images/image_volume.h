#pragma once
/// A dense image as a sparse volume.

#include <cstdint>
#include <optional>

#include "esvr/sparse_volume.h"
#include "generators/sample_options.h"
#include "images/image_source.h"

namespace esvr::samples {

struct ImageOptions {
  /// In the image's units: active where value >= threshold; nothing: where value != background.
  std::optional<double> threshold{};
  double background = 0.0;  ///< in the image's units: the value of what is not active
  /// Divides by the type's largest value, or where the type is no integer by the largest |value|.
  bool normalise = false;
  bool zeroNonFinite = false;  ///< NaN and infinite voxels become 0 instead of an error
};

struct ImageVolume {
  SparseVolume volume;
  std::uint64_t nonFiniteReplaced = 0;
};

/// Reads the image slab by slab: memory follows the active bricks, not the image.
/// \throws BadInput  non-finite voxels (the first and their count), nothing to normalise by
[[nodiscard]] ImageVolume volumeOf(ImageSource& image, const ImageOptions& options,
                                   const Limits& limits);

}  // namespace esvr::samples
