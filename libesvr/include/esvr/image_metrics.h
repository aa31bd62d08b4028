#pragma once
/// How far a picture is from its reference. Compared are the colors in front of black, each channel
/// from 0 to 1; alpha takes no part, since two pictures of one look may differ in it.

#include <span>

#include "esvr/image.h"

namespace esvr {

struct ImageMetrics {
  double psnr = 0.0;      ///< dB, of a peak of 1, over all channels; +inf where nothing differs
  double ssim = 1.0;      ///< mean over pixels and channels
  double maxError = 0.0;  ///< largest difference of a channel
};

/// Colors outside 0 to 1 count as the nearer end: nothing shows them. SSIM: Gaussian window of
/// 11^2, sigma 1.5, C1 = 0.01^2, C2 = 0.03^2 (Wang et al. 2004); windows are clipped at the
/// picture's border and renormalised. The same bits for any number of threads.
/// \throws UsageError  pictures of different sizes or without a pixel; BadInput: a color is no
///                     number
[[nodiscard]] ImageMetrics compareImages(const Image& reference, const Image& candidate);

/// Gray, opaque: of each pixel the largest difference of a channel, times `gain`, at most 1.
/// \throws UsageError  pictures of different sizes
[[nodiscard]] Image errorMap(const Image& reference, const Image& candidate, double gain);

/// Pictures of one size beside each other, from left to right.
/// \throws UsageError  none, or of different sizes
[[nodiscard]] Image sideBySide(std::span<const Image> images);

}  // namespace esvr
