#pragma once
/// FLIP: the difference that someone sees who flips between two pictures (Andersson et al., "FLIP:
/// A Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2),
/// 2020), for pictures as a screen shows them (LDR-FLIP).

#include <numbers>
#include <vector>

#include "esvr/image.h"

namespace esvr {

/// Pixels a degree for someone 0.7 m from a screen of 0.7 m and 3840 pixels: about 67.
inline constexpr double kFlipPixelsPerDegree = 0.7 * 3840 / 0.7 * std::numbers::pi / 180;

struct Flip {
  double mean = 0.0;
  double max = 0.0;
  std::vector<float> map;  ///< 0 to 1 a pixel, row after row from the top
};

/// Compares the colors in front of black, in sRGB; those outside 0 to 1 count as the nearer end,
/// and alpha takes no part. Float64 throughout; the same bits for any number of threads. \throws
/// UsageError  pictures of different sizes or without a pixel; pixelsPerDegree not above 0;
///         BadInput: a color is no number
[[nodiscard]] Flip flip(const Image& reference, const Image& candidate,
                        double pixelsPerDegree = kFlipPixelsPerDegree);

}  // namespace esvr
