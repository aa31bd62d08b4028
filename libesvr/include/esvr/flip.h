#pragma once
/// FLIP: the difference that a viewer sees when two pictures alternate (Andersson et al., "FLIP: A
/// Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2),
/// 2020), in the form for sRGB pictures (LDR-FLIP).

#include <numbers>
#include <vector>

#include "esvr/image.h"

namespace esvr {

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
