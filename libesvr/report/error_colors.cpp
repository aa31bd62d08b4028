#include "report/error_colors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "report/pixel_level.h"

namespace esvr::report {
namespace {

using RampColor = std::array<double, 3>;

/// sRGB colors at equal distances. Each is brighter than the one before it.
constexpr std::array<RampColor, 5> kRamp{{{0.00, 0.00, 0.00},
                                          {0.30, 0.07, 0.48},
                                          {0.74, 0.19, 0.36},
                                          {0.98, 0.56, 0.10},
                                          {1.00, 0.98, 0.70}}};
constexpr std::array kScaleTicks{0.0, 0.005, 0.02, 0.05, 0.08, kMostError};

/// Where the color of an error is between the first color, at 0, and the last one, at 1.
double placeOf(double share) { return std::sqrt(std::clamp(share, 0.0, 1.0)); }

RampColor colorAt(double place) {
  const double at = place * double(kRamp.size() - 1);
  const std::size_t below = std::min(std::size_t(at), kRamp.size() - 2);
  const double part = at - double(below);
  RampColor color{};
  for (std::size_t c = 0; c < color.size(); ++c)
    color[c] = (1.0 - part) * kRamp[below][c] + part * kRamp[below + 1][c];
  return color;
}

std::string printed(const char* format, double value) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

Html gradient() {
  Html stops;
  for (std::size_t i = 0; i < kRamp.size(); ++i) {
    const auto level = [&](std::size_t c) { return std::to_string(levelOf(kRamp[i][c])); };
    stops += element("stop",
                     {{"offset", printed("%.2f", double(i) / double(kRamp.size() - 1))},
                      {"stop-color", "rgb(" + level(0) + "," + level(1) + "," + level(2) + ")"}},
                     Html{});
  }
  return element("linearGradient", {{"id", "error-colors"}}, stops);
}

}  // namespace

void colorErrors(Image& map) {
  for (std::size_t i = 0; i < map.rgba.size(); i += 4) {
    const RampColor color = colorAt(placeOf(double(map.rgba[i])));
    for (std::size_t c = 0; c < color.size(); ++c) map.rgba[i + c] = float(color[c]);
  }
}

Html errorScale() {
  constexpr double kWidth = 440.0, kEdge = 16.0, kHeight = 18.0, kText = 34.0;
  Html content = gradient();
  content += element("rect",
                     {{"class", "frame"},
                      {"x", printed("%.0f", kEdge)},
                      {"y", "1"},
                      {"width", printed("%.0f", kWidth)},
                      {"height", printed("%.0f", kHeight)},
                      {"style", "fill: url(#error-colors)"}},
                     Html{});
  for (const double tick : kScaleTicks)
    content += element("text",
                       {{"x", printed("%.1f", kEdge + kWidth * placeOf(tick / kMostError))},
                        {"y", printed("%.0f", kText)},
                        {"text-anchor", "middle"}},
                       printed("%g", tick));
  const std::string most = printed("%g", kMostError);
  Html figure =
      element("svg",
              {{"viewBox", "0 0 480 40"},
               {"role", "img"},
               {"aria-label", "colors of errors from 0 (black) to " + most + " (light yellow)"}},
              content);
  figure += element("figcaption",
                    "Error maps: the largest difference of a pixel's channels, which are between 0 "
                    "and 1. Errors above " +
                        most + " have the last color.");
  return element("figure", {{"class", "scale"}}, figure);
}

}  // namespace esvr::report
