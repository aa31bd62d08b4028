#include "esvr/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "esvr/error.h"
#include "metrics/flip_color.h"
#include "metrics/flip_filters.h"
#include "metrics/shown_pictures.h"

namespace esvr {
namespace {

using metrics::Color;
using metrics::kChannels, metrics::kColors;
using metrics::Plane;

// Exponents and knee of the paper's equations 4 to 7.
constexpr double kColorExponent = 0.7, kFeatureExponent = 0.5;
constexpr double kKneeAt = 0.4, kKneeValue = 0.95;

using Planes = std::array<Plane, kColors>;

void checkPictures(const Image& reference, const Image& candidate, double pixelsPerDegree) {
  metrics::requireEqualSizes(reference, candidate);
  if (!(pixelsPerDegree > 0.0) || !std::isfinite(pixelsPerDegree))
    throw UsageError("FLIP needs pixels per degree above 0, not " +
                     std::to_string(pixelsPerDegree));
}

Color shownColor(const float* rgba) {
  Color color;
  for (int c = 0; c < kColors; ++c) color[c] = metrics::shownValue(rgba[c]);
  return color;
}

/// Converts a picture to opponent colors.
Planes ycxczOf(const Image& image) {
  Planes planes;
  const std::size_t pixels = std::size_t(image.width) * image.height;
  for (Plane& plane : planes) plane = {image.width, image.height, std::vector<double>(pixels)};
  for (std::size_t i = 0; i < pixels; ++i) {
    const Color color =
        metrics::ycxczFromLinear(metrics::linearFromSrgb(shownColor(&image.rgba[i * kChannels])));
    for (int c = 0; c < kColors; ++c) planes[c].values[i] = color[c];
  }
  return planes;
}

/// Filters a picture by contrast sensitivity and converts it to a space of perceived differences.
std::vector<Color> perceivedColors(const Planes& ycxcz, const metrics::EyeFilters& eye) {
  const Planes seen{blurred(ycxcz[0], eye.achromatic), blurred(ycxcz[1], eye.redGreen),
                    blurred(ycxcz[2], eye.blueYellow)};
  std::vector<Color> colors(seen[0].values.size());
  for (std::size_t i = 0; i < colors.size(); ++i) {
    Color linear =
        metrics::linearFromYcxcz({seen[0].values[i], seen[1].values[i], seen[2].values[i]});
    for (double& v : linear) v = std::clamp(v, 0.0, 1.0);
    colors[i] = metrics::huntLabFromLinear(linear);
  }
  return colors;
}

/// The largest difference of two sRGB colors, which is that of green and blue.
double largestColorDifference() {
  return std::pow(metrics::hyab(metrics::huntLabFromLinear({0.0, 1.0, 0.0}),
                                metrics::huntLabFromLinear({0.0, 0.0, 1.0})),
                  kColorExponent);
}

/// Maps a color difference to 0 to 1 with a knee, so that usual differences cover most of the
/// range.
double redistributed(double difference, double largest) {
  const double knee = kKneeAt * largest;
  if (difference < knee) return kKneeValue / knee * difference;
  return kKneeValue + (difference - knee) / (largest - knee) * (1.0 - kKneeValue);
}

/// The strength of edges and points at each pixel.
struct Features {
  std::vector<double> edges, points;
};

std::vector<double> lengths(const Plane& x, const Plane& y) {
  std::vector<double> result(x.values.size());
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = std::hypot(x.values[i], y.values[i]);
  return result;
}

Features featuresOf(Plane luminance, const metrics::FeatureFilters& f) {
  for (double& y : luminance.values) y = (y + 16.0) / 116.0;
  return {lengths(filtered(luminance, f.edge, f.across), filtered(luminance, f.across, f.edge)),
          lengths(filtered(luminance, f.point, f.across), filtered(luminance, f.across, f.point))};
}

double featureDifference(const Features& a, const Features& b, std::size_t i) {
  const double difference =
      std::max(std::abs(a.edges[i] - b.edges[i]), std::abs(a.points[i] - b.points[i]));
  return std::pow(difference / std::sqrt(2.0), kFeatureExponent);
}

/// The filtered colors and features of one picture.
struct Seen {
  std::vector<Color> colors;
  Features features;
};

Seen see(const Image& image, double pixelsPerDegree) {
  Planes ycxcz = ycxczOf(image);
  auto colors = perceivedColors(ycxcz, metrics::eyeFilters(pixelsPerDegree));
  return {std::move(colors),
          featuresOf(std::move(ycxcz[0]), metrics::featureFilters(pixelsPerDegree))};
}

}  // namespace

Flip flip(const Image& reference, const Image& candidate, double pixelsPerDegree) {
  checkPictures(reference, candidate, pixelsPerDegree);
  const Seen a = see(reference, pixelsPerDegree), b = see(candidate, pixelsPerDegree);
  const double largest = largestColorDifference();
  Flip result;
  for (std::size_t i = 0; i < a.colors.size(); ++i) {
    const double color =
        redistributed(std::pow(metrics::hyab(a.colors[i], b.colors[i]), kColorExponent), largest);
    const double error = std::pow(color, 1.0 - featureDifference(a.features, b.features, i));
    result.mean += error;
    result.max = std::max(result.max, error);
    result.map.push_back(float(error));
  }
  result.mean /= double(a.colors.size());
  return result;
}

}  // namespace esvr
