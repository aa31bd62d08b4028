#pragma once
/// Differences of pictures.

#include <numbers>
#include <span>
#include <vector>

#include "esvr/image.h"

namespace esvr {

// Errors of a picture against a reference. The colors in front of black are compared, each channel
// between 0 and 1. Alpha is ignored, since pictures that look the same may differ in it.

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

// FLIP: the difference that a viewer sees when two pictures alternate (Andersson et al., "FLIP: A
// Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2),
// 2020), in the form for sRGB pictures (LDR-FLIP).

/// Pixels per degree for a viewer 0.7 m from a screen that is 0.7 m wide and has 3840 pixels: 67.
inline constexpr double kFlipPixelsPerDegree = 0.7 * 3840 / 0.7 * std::numbers::pi / 180;

struct Flip {
  double mean = 0.0;
  double max = 0.0;
  std::vector<float> map;  ///< difference of each pixel, 0 to 1, row by row from the top
};

/// Compares the colors in front of black, in sRGB. Channels are clamped to 0 to 1, and alpha is
/// ignored. The computation is in float64 and bit-identical for any number of threads.
/// \throws UsageError  the pictures differ in size or have no pixels; pixelsPerDegree is not above
///                     0
/// \throws BadInput    a color is NaN
[[nodiscard]] Flip flip(const Image& reference, const Image& candidate,
                        double pixelsPerDegree = kFlipPixelsPerDegree);

}  // namespace esvr
