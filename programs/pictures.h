#pragma once
/// Pictures as PNG with 8 bits a channel, and color bars, which say what values the colors of a picture
/// stand for. Cairo makes both.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "esvr/image.h"

namespace esvr::report {

/// The level of a color from 0 to 1. Colors outside this range are clamped.
inline std::uint8_t levelOf(double color) {
  constexpr double kMaxLevel = 255.0;
  return std::uint8_t(std::lround(std::clamp(color, 0.0, 1.0) * kMaxLevel));
}

/// The colors in front of black with 8 bits per channel, as PNG.
/// \throws RuntimeFailure  cairo reports an error
[[nodiscard]] std::string toPng(const Image& image);

/// A place on the scale of a color bar.
struct Tick {
  double value = 0.0;
  std::string label;
};

/// Ticks at round numbers from `low` to `high`. The labels have as many digits as distinguish them.
/// A range that is too narrow for that, or not finite, has one tick, at `low`.
/// \param intervals  largest number of intervals between the ticks
[[nodiscard]] std::vector<Tick> roundTicks(double low, double high, double intervals);

/// The color of a value.
struct Shade {
  std::array<double, 3> color{};  ///< sRGB
  double opacity = 1.0;
};

struct ColorBar {
  std::string name{}, unit{};                       ///< texts above the bar; no unit if it is empty
  double low = 0.0, high = 1.0;                     ///< values at the ends of the bar
  std::vector<Shade> shades{};                      ///< shades of the values from `low` to `high`
  std::array<double, 3> background{1.0, 1.0, 1.0};  ///< sRGB color behind the picture
};

/// The share of a picture's width that a color bar takes at the right edge, at most kMaxBarShare.
/// Texts are as large as a fixed share of the picture's height, unless the bar would be too wide.
/// \throws RuntimeFailure  cairo reports an error (the text is cairo's)
[[nodiscard]] double colorBarShare(const ColorBar& bar, int width, int height);
inline constexpr double kMaxBarShare = 0.35;

/// Draws a color bar at the right edge of a picture, in front of a translucent panel of the background's
/// color. The bar has two columns: the colors alone, and the colors in front of a checkerboard with the opacity of
/// their values. Texts that would be less than five pixels high are left out.
/// \throws RuntimeFailure  as for colorBarShare
void drawColorBar(const ColorBar& bar, Image& picture);

}  // namespace esvr::report
