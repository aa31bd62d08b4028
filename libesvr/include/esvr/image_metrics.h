#pragma once
/// Errors of a picture against a reference. The colors in front of black are compared, each channel
/// between 0 and 1. Alpha is ignored, since pictures that look the same may differ in it.

#include <span>

#include "esvr/image.h"

namespace esvr {

struct ImageMetrics {
  double psnr = 0.0;      ///< dB over all channels, with a peak of 1; +inf for equal pictures
  double ssim = 1.0;      ///< mean over pixels and channels
  double maxError = 0.0;  ///< largest difference of a channel
};

/// Compares two pictures. Channels are clamped to 0 to 1. SSIM uses a Gaussian window of 11^2
/// pixels, sigma 1.5, C1 = 0.01^2, C2 = 0.03^2 (Wang et al. 2004); windows are clipped at the
/// picture's border and renormalised. The result is bit-identical for any number of threads.
/// \throws UsageError  the pictures differ in size or have no pixels
/// \throws BadInput    a color is NaN
[[nodiscard]] ImageMetrics compareImages(const Image& reference, const Image& candidate);

/// An opaque gray picture of the errors: the largest difference of a pixel's channels times `gain`,
/// at most 1.
/// \throws UsageError  the pictures differ in size
[[nodiscard]] Image errorMap(const Image& reference, const Image& candidate, double gain);

/// Places pictures of one size side by side, from left to right.
/// \throws UsageError  there are no pictures, or they differ in size
[[nodiscard]] Image sideBySide(std::span<const Image> images);

}  // namespace esvr
