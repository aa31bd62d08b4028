/// Errors of pictures: PSNR, SSIM and the largest difference; and pictures that are made from pictures.
///
/// FLIP of two pictures, in the order of the paper: colors are converted to opponent colors, filtered as
/// the eye sees them and compared; edges and points are found in the luminance; both differences are
/// joined. Filters are products of a filter along x and one along y, or sums of these.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/image.h"
#include "esvr/image_metrics.h"
#include "esvr/metrics.h"
#include "field/ssim_window.h"

namespace esvr::metrics {

inline constexpr int kChannels = 4, kColors = 3;  ///< a pixel has so many

/// \throws UsageError  the pictures have no pixel or differ in size
inline void requireEqualSizes(const Image& reference, const Image& candidate) {
  const auto sizeOf = [](const Image& image) {
    return std::to_string(image.width) + " x " + std::to_string(image.height);
  };
  if (reference.width < 1 || reference.height < 1)
    throw UsageError("a picture of " + sizeOf(reference) + " pixels cannot be compared");
  if (reference.width != candidate.width || reference.height != candidate.height)
    throw UsageError("pictures of " + sizeOf(reference) + " and " + sizeOf(candidate) +
                     " pixels cannot be compared");
}

/// The value of a color as a screen shows it, clamped to 0 to 1.
/// \throws BadInput  it is not a number
[[nodiscard]] inline double shownValue(float value) {
  if (std::isnan(value)) throw BadInput("a picture has a color that is not a number");
  return std::clamp(double(value), 0.0, 1.0);
}

}  // namespace esvr::metrics

namespace esvr {
namespace {

using metrics::kChannels, metrics::kColors;

constexpr double kPeak = 1.0;
constexpr int kRowsPerTask = 16;

using Rows = tbb::blocked_range<int>;

/// One color channel, clamped to 0 to 1.
class Channel {
 public:
  Channel(const Image& image, int channel)
      : width(image.width), height(image.height), values_(std::size_t(width) * height) {
    for (std::size_t i = 0; i < values_.size(); ++i)
      values_[i] = metrics::shownValue(image.rgba[i * kChannels + channel]);
  }
  const int width, height;
  [[nodiscard]] const double* row(int y) const { return &values_[std::size_t(y) * width]; }
  [[nodiscard]] double* row(int y) { return &values_[std::size_t(y) * width]; }

 private:
  std::vector<double> values_;
};

/// The taps of a window that lie in a picture, and the sum of their weights.
struct Taps {
  int first, last;
  double weight;
};

class Window {
 public:
  [[nodiscard]] Taps within(int at, int size) const {
    Taps taps{std::max(0, kSsimRadius - at), std::min(kSsimTaps - 1, size - 1 - at + kSsimRadius),
              0.0};
    for (int t = taps.first; t <= taps.last; ++t) taps.weight += weights_[std::size_t(t)];
    return taps;
  }
  [[nodiscard]] double weight(int tap) const { return weights_[std::size_t(tap)]; }

 private:
  std::array<double, kSsimTaps> weights_ = ssimWeights();
};

/// Weighted means of a, b, a^2, b^2 and a b over windows.
struct Means {
  double a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;

  void add(double w, const Means& m) {
    a += w * m.a, b += w * m.b, aa += w * m.aa, bb += w * m.bb, ab += w * m.ab;
  }
};

Means productsOf(double a, double b) { return {a, b, a * a, b * b, a * b}; }

/// Sums along the columns for a row of windows.
std::vector<Means> columnMeans(const Channel& a, const Channel& b, const Window& window, int y) {
  std::vector<Means> means(a.width);
  const Taps taps = window.within(y, a.height);
  for (int t = taps.first; t <= taps.last; ++t) {
    const double *rowA = a.row(y + t - kSsimRadius), *rowB = b.row(y + t - kSsimRadius);
    const double weight = window.weight(t) / taps.weight;
    for (int x = 0; x < a.width; ++x) means[x].add(weight, productsOf(rowA[x], rowB[x]));
  }
  return means;
}

Means windowMeans(const std::vector<Means>& columns, const Window& window, int x) {
  const Taps taps = window.within(x, int(columns.size()));
  Means means;
  for (int t = taps.first; t <= taps.last; ++t)
    means.add(window.weight(t) / taps.weight, columns[x + t - kSsimRadius]);
  return means;
}

double ssimOf(const Means& m, const SsimConstants& c) {
  const double squares = m.a * m.a + m.b * m.b;
  return (2.0 * m.a * m.b + c.c1) / (squares + c.c1) * (2.0 * (m.ab - m.a * m.b) + c.c2) /
         (m.aa + m.bb - squares + c.c2);
}

double ssimOfRow(const Channel& a, const Channel& b, const Window& window, int y) {
  const auto columns = columnMeans(a, b, window, y);
  const SsimConstants constants = ssimConstants(kPeak);
  double sum = 0.0;
  for (int x = 0; x < a.width; ++x) sum += ssimOf(windowMeans(columns, window, x), constants);
  return sum;
}

template <class OfRow>
double sumOverRows(int rows, OfRow&& ofRow) {
  return parallelDeterministicReduce(
      Rows(0, rows, kRowsPerTask), 0.0,
      [&](const Rows& range, double sum) {
        for (int y = range.begin(); y != range.end(); ++y) sum += ofRow(y);
        return sum;
      },
      std::plus<>());
}

double squaresOfRow(const Channel& a, const Channel& b, int y) {
  double sum = 0.0;
  for (int x = 0; x < a.width; ++x) {
    const double d = a.row(y)[x] - b.row(y)[x];
    sum += d * d;
  }
  return sum;
}

double largestDifference(const Channel& a, const Channel& b) {
  double largest = 0.0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x)
      largest = std::max(largest, std::abs(a.row(y)[x] - b.row(y)[x]));
  return largest;
}

}  // namespace

ImageMetrics compareImages(const Image& reference, const Image& candidate) {
  metrics::requireEqualSizes(reference, candidate);
  const Window window;
  const double samples = double(reference.width) * reference.height * kColors;
  double squares = 0.0, ssim = 0.0;
  ImageMetrics metrics;
  for (int channel = 0; channel < kColors; ++channel) {
    const Channel a(reference, channel), b(candidate, channel);
    squares += sumOverRows(a.height, [&](int y) { return squaresOfRow(a, b, y); });
    ssim += sumOverRows(a.height, [&](int y) { return ssimOfRow(a, b, window, y); });
    metrics.maxError = std::max(metrics.maxError, largestDifference(a, b));
  }
  metrics.psnr = psnr(squares / samples, kPeak);
  metrics.ssim = ssim / samples;
  return metrics;
}

Image errorMap(const Image& reference, const Image& candidate, double gain) {
  metrics::requireEqualSizes(reference, candidate);
  Image map{reference.width, reference.height, std::vector<float>(reference.rgba.size(), 1.0f)};
  for (std::size_t i = 0; i < map.rgba.size(); i += kChannels) {
    double largest = 0.0;
    for (int c = 0; c < kColors; ++c)
      largest = std::max(largest, std::abs(double(reference.rgba[i + c]) - candidate.rgba[i + c]));
    for (int c = 0; c < kColors; ++c) map.rgba[i + c] = float(std::min(1.0, largest * gain));
  }
  return map;
}

Image sideBySide(std::span<const Image> images) {
  if (images.empty()) throw UsageError("there are no pictures to place side by side");
  for (const Image& image : images) metrics::requireEqualSizes(images.front(), image);
  const std::size_t ofRow = std::size_t(kChannels) * std::size_t(images.front().width);
  Image all{int(images.size()) * images.front().width, images.front().height, {}};
  all.rgba.reserve(images.size() * images.front().rgba.size());
  for (std::size_t row = 0; row < std::size_t(all.height); ++row)
    for (const Image& image : images) {
      const auto from = image.rgba.begin() + std::ptrdiff_t(row * ofRow);
      all.rgba.insert(all.rgba.end(), from, from + std::ptrdiff_t(ofRow));
    }
  return all;
}

Image meansOfSquares(const Image& image, int side) {
  if (side < 1 || image.width % side != 0 || image.height % side != 0)
    throw UsageError("a picture of " + std::to_string(image.width) + " x " +
                     std::to_string(image.height) + " pixels has no squares with a side of " +
                     std::to_string(side));
  const auto offsetOf = [](const Image& picture, int x, int y) {
    return kChannels * (std::size_t(y) * std::size_t(picture.width) + std::size_t(x));
  };
  Image means{image.width / side, image.height / side, {}};
  means.rgba.resize(offsetOf(means, 0, means.height));
  parallelFor(0, means.height, [&](int row) {
    for (int column = 0; column < means.width; ++column) {
      double sums[kChannels]{};
      for (int y = row * side; y < (row + 1) * side; ++y)
        for (int x = column * side; x < (column + 1) * side; ++x)
          for (int c = 0; c < kChannels; ++c)
            sums[c] += double(image.rgba[offsetOf(image, x, y) + std::size_t(c)]);
      for (int c = 0; c < kChannels; ++c)
        means.rgba[offsetOf(means, column, row) + std::size_t(c)] =
            float(sums[c] / (double(side) * double(side)));
    }
  });
  return means;
}

}  // namespace esvr

// ---- FLIP

namespace esvr::metrics {
namespace {

// Color spaces: sRGB to linear RGB, CIE XYZ, YCxCz (a linear L*a*b*) and L*a*b*, all under D65.

using Color = std::array<double, 3>;
using Matrix = std::array<Color, 3>;  // rows

/// Matrix from linear RGB to XYZ for sRGB's primaries and D65.
constexpr Matrix kXyzFromRgb{{
    {10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0},
    {2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0},
    {1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0},
}};

constexpr Color times(const Matrix& m, const Color& v) {
  Color result{};
  for (int row = 0; row < 3; ++row)
    result[row] = m[row][0] * v[0] + m[row][1] * v[1] + m[row][2] * v[2];
  return result;
}

/// XYZ of white, RGB (1, 1, 1).
constexpr Color kWhite = times(kXyzFromRgb, {1.0, 1.0, 1.0});

/// Cofactor of an entry. Rows and columns are taken cyclically, which gives the right sign.
constexpr double cofactor(const Matrix& m, int row, int column) {
  const int r1 = (row + 1) % 3, r2 = (row + 2) % 3;
  const int c1 = (column + 1) % 3, c2 = (column + 2) % 3;
  return m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
}

constexpr Matrix inverse(const Matrix& m) {
  double determinant = 0.0;
  for (int i = 0; i < 3; ++i) determinant += m[0][i] * cofactor(m, 0, i);
  Matrix result{};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      result[row][column] = cofactor(m, column, row) / determinant;
  return result;
}

constexpr Matrix kRgbFromXyz = inverse(kXyzFromRgb);

Color relativeToWhite(const Color& xyz) {
  return {xyz[0] / kWhite[0], xyz[1] / kWhite[1], xyz[2] / kWhite[2]};
}

/// Converts three stimuli to lightness and two opponent colors, and back.
Color opponent(const Color& v) {
  return {116.0 * v[1] - 16.0, 500.0 * (v[0] - v[1]), 200.0 * (v[1] - v[2])};
}
Color stimuli(const Color& opponentColor) {
  const double y = (opponentColor[0] + 16.0) / 116.0;
  return {y + opponentColor[1] / 500.0, y, y - opponentColor[2] / 200.0};
}

/// Converts a picture's color to linear RGB (IEC 61966-2-1).
Color linearFromSrgb(const float* rgba) {
  Color color;
  for (int c = 0; c < kColors; ++c) {
    const double srgb = shownValue(rgba[c]);
    color[c] = srgb > 0.04045 ? std::pow((srgb + 0.055) / 1.055, 2.4) : srgb / 12.92;
  }
  return color;
}

/// Converts to opponent colors (YCxCz), which are linear in light and which the filters act on.
Color ycxczFromLinear(const Color& linear) {
  return opponent(relativeToWhite(times(kXyzFromRgb, linear)));
}

Color linearFromYcxcz(const Color& ycxcz) {
  const Color v = stimuli(ycxcz);
  return times(kRgbFromXyz, {v[0] * kWhite[0], v[1] * kWhite[1], v[2] * kWhite[2]});
}

/// L*a*b* with the Hunt effect: a and b are multiplied by L / 100.
Color huntLabFromLinear(const Color& linear) {
  // CIE's cube root, which is linear near black
  const auto lightness = [](double v) {
    constexpr double kDelta = 6.0 / 29.0;
    return v > kDelta * kDelta * kDelta ? std::cbrt(v) : v / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
  };
  const Color v = relativeToWhite(times(kXyzFromRgb, linear));
  const Color lab = opponent({lightness(v[0]), lightness(v[1]), lightness(v[2])});
  return {lab[0], 0.01 * lab[0] * lab[1], 0.01 * lab[0] * lab[2]};
}

/// The distance |difference of L| + length of the difference of chroma (Abasi et al. 2020).
double hyab(const Color& a, const Color& b) {
  return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

// Filters.

/// One channel of a picture.
struct Plane {
  int width = 0, height = 0;
  std::vector<double> values;
};

/// Weights at the offsets -radius to radius.
using FilterTaps = std::vector<double>;

/// A plane like another one, whose rows are written by ofRow(y, row) in parallel.
template <class OfRow>
Plane rowByRow(const Plane& like, const OfRow& ofRow) {
  constexpr int kRowsPerTask = 16;
  Plane result{like.width, like.height, std::vector<double>(like.values.size())};
  parallelFor(tbb::blocked_range<int>(0, like.height, kRowsPerTask), [&](const auto& range) {
    for (int y = range.begin(); y != range.end(); ++y)
      ofRow(y, &result.values[std::size_t(y) * like.width]);
  });
  return result;
}

/// Filters a plane with the taps `alongX` along rows and `alongY` along columns. Outside the plane, the
/// value of the nearest border pixel is used.
Plane filtered(const Plane& plane, const FilterTaps& alongX, const FilterTaps& alongY) {
  const int width = plane.width;
  const Plane rows = rowByRow(plane, [&](int y, double* to) {
    const double* from = &plane.values[std::size_t(y) * width];
    const int radius = int(alongX.size()) / 2;
    for (int x = 0; x < width; ++x) {
      double value = 0.0;
      for (int t = -radius; t <= radius; ++t)
        value += alongX[std::size_t(t + radius)] * from[std::clamp(x + t, 0, width - 1)];
      to[x] = value;
    }
  });
  return rowByRow(plane, [&](int y, double* to) {
    const int radius = int(alongY.size()) / 2;
    for (int t = -radius; t <= radius; ++t) {
      const int from = std::clamp(y + t, 0, plane.height - 1);
      const double weight = alongY[std::size_t(t + radius)];
      const double* row = &rows.values[std::size_t(from) * width];
      for (int x = 0; x < width; ++x) to[x] += weight * row[x];
    }
  });
}

constexpr double kPi = std::numbers::pi;
constexpr double kRadiusInSigmas = 3.0;  // radius of a filter in standard deviations

double sumOf(const FilterTaps& taps) { return std::accumulate(taps.begin(), taps.end(), 0.0); }

/// The weights weight(x) for x from -radius to radius.
template <class Weight>
FilterTaps makeTaps(int radius, const Weight& weight) {
  FilterTaps taps;
  for (int x = -radius; x <= radius; ++x) taps.push_back(weight(double(x)));
  return taps;
}

FilterTaps scaled(FilterTaps taps, double by) {
  for (double& tap : taps) tap *= by;
  return taps;
}

/// A Gaussian of the paper's fit: a sqrt(pi / b) exp(-pi^2 d^2 / b) with d in degrees.
struct Term {
  double a, b;
};
constexpr Term kAchromatic{1.0, 0.0047}, kRedGreen{1.0, 0.0053}, kBlueYellow1{34.1, 0.04},
    kBlueYellow2{13.5, 0.025};
constexpr double kWidest = kBlueYellow1.b;

/// A term of a sum of filters, with the same taps along both axes.
struct Blur {
  double share = 1.0;
  FilterTaps taps;  ///< sum up to 1
};

/// Makes blurs of the terms; their shares have the sum 1.
std::vector<Blur> blursOf(std::initializer_list<Term> terms, double pixelsPerDegree) {
  const int radius =
      int(std::ceil(kRadiusInSigmas * std::sqrt(kWidest / (2.0 * kPi * kPi)) * pixelsPerDegree));
  std::vector<Blur> blurs;
  double total = 0.0;
  for (const Term& term : terms) {
    const FilterTaps taps = makeTaps(radius, [&](double x) {
      const double degrees = x / pixelsPerDegree;
      return std::exp(-kPi * kPi * degrees * degrees / term.b);
    });
    const double along = sumOf(taps);
    const double weight = term.a * std::sqrt(kPi / term.b) * along * along;
    blurs.push_back({weight, scaled(taps, 1.0 / along)});
    total += weight;
  }
  for (Blur& blur : blurs) blur.share /= total;
  return blurs;
}

Plane blurred(const Plane& plane, const std::vector<Blur>& blurs) {
  Plane result{plane.width, plane.height, std::vector<double>(plane.values.size())};
  for (const Blur& blur : blurs) {
    const Plane part = filtered(plane, blur.taps, blur.taps);
    for (std::size_t i = 0; i < part.values.size(); ++i)
      result.values[i] += blur.share * part.values[i];
  }
  return result;
}

/// Derivatives of a Gaussian that has the width of an edge that the eye detects. The positive
/// weights have the sum 1, the negative ones the sum -1.
struct FeatureFilters {
  FilterTaps edge, point, across;

  explicit FeatureFilters(double pixelsPerDegree) {
    constexpr double kEdgeWidth = 0.082;  // degrees: two standard deviations
    const double deviation = 0.5 * kEdgeWidth * pixelsPerDegree;
    const int radius = int(std::ceil(kRadiusInSigmas * deviation));
    const auto bell = [&](double x) { return std::exp(-x * x / (2.0 * deviation * deviation)); };
    edge = balanced(makeTaps(radius, [&](double x) { return -x * bell(x); }));
    point = balanced(makeTaps(
        radius, [&](double x) { return (x * x / (deviation * deviation) - 1.0) * bell(x); }));
    across = makeTaps(radius, bell);
    across = scaled(across, 1.0 / sumOf(across));
  }

 private:
  static FilterTaps balanced(FilterTaps taps) {
    double positive = 0.0, negative = 0.0;
    for (const double tap : taps) (tap > 0.0 ? positive : negative) += std::abs(tap);
    for (double& tap : taps) tap /= tap > 0.0 ? positive : negative;
    return taps;
  }
};

// The two pictures.

/// The filtered colors of a picture, and the strength of edges and points at each pixel.
struct SeenPicture {
  std::vector<Color> colors;
  std::vector<double> edges, points;

  SeenPicture(const Image& image, double pixelsPerDegree) {
    std::array<Plane, kColors> ycxcz;
    const std::size_t pixels = std::size_t(image.width) * image.height;
    for (Plane& plane : ycxcz) plane = {image.width, image.height, std::vector<double>(pixels)};
    for (std::size_t i = 0; i < pixels; ++i) {
      const Color color = ycxczFromLinear(linearFromSrgb(&image.rgba[i * kChannels]));
      for (int c = 0; c < kColors; ++c) ycxcz[c].values[i] = color[c];
    }
    findColors(ycxcz, pixelsPerDegree);
    findFeatures(std::move(ycxcz[0]), FeatureFilters(pixelsPerDegree));
  }

 private:
  /// Filters a picture by contrast sensitivity, with Gaussians that were fitted to that of the eye, and
  /// converts it to a space of perceived differences.
  void findColors(const std::array<Plane, kColors>& ycxcz, double pixelsPerDegree) {
    const Plane y = blurred(ycxcz[0], blursOf({kAchromatic}, pixelsPerDegree));
    const Plane cx = blurred(ycxcz[1], blursOf({kRedGreen}, pixelsPerDegree));
    const Plane cz = blurred(ycxcz[2], blursOf({kBlueYellow1, kBlueYellow2}, pixelsPerDegree));
    colors.resize(y.values.size());
    for (std::size_t i = 0; i < colors.size(); ++i) {
      Color linear = linearFromYcxcz({y.values[i], cx.values[i], cz.values[i]});
      for (double& v : linear) v = std::clamp(v, 0.0, 1.0);
      colors[i] = huntLabFromLinear(linear);
    }
  }

  void findFeatures(Plane luminance, const FeatureFilters& f) {
    for (double& y : luminance.values) y = (y + 16.0) / 116.0;
    const auto strengths = [&](const FilterTaps& taps) {
      const Plane x = filtered(luminance, taps, f.across), y = filtered(luminance, f.across, taps);
      std::vector<double> lengths(x.values.size());
      for (std::size_t i = 0; i < lengths.size(); ++i)
        lengths[i] = std::hypot(x.values[i], y.values[i]);
      return lengths;
    };
    edges = strengths(f.edge);
    points = strengths(f.point);
  }
};

// Exponents and knee of the paper's equations 4 to 7.
constexpr double kColorExponent = 0.7, kFeatureExponent = 0.5;
constexpr double kKneeAt = 0.4, kKneeValue = 0.95;

/// The difference of two colors, mapped to 0 to 1 with a knee, so that usual differences cover most of the
/// range. \param largest  the largest difference of two sRGB colors
double colorDifference(const Color& a, const Color& b, double largest) {
  const double difference = std::pow(hyab(a, b), kColorExponent), knee = kKneeAt * largest;
  if (difference < knee) return kKneeValue / knee * difference;
  return kKneeValue + (difference - knee) / (largest - knee) * (1.0 - kKneeValue);
}

double featureDifference(const SeenPicture& a, const SeenPicture& b, std::size_t i) {
  const double difference =
      std::max(std::abs(a.edges[i] - b.edges[i]), std::abs(a.points[i] - b.points[i]));
  return std::pow(difference / std::sqrt(2.0), kFeatureExponent);
}

}  // namespace
}  // namespace esvr::metrics

namespace esvr {

Flip flip(const Image& reference, const Image& candidate, double pixelsPerDegree) {
  using namespace metrics;
  requireEqualSizes(reference, candidate);
  if (!(pixelsPerDegree > 0.0) || !std::isfinite(pixelsPerDegree))
    throw UsageError("FLIP needs pixels per degree above 0, not " +
                     std::to_string(pixelsPerDegree));
  const SeenPicture a(reference, pixelsPerDegree), b(candidate, pixelsPerDegree);
  // The largest difference is that of green and blue.
  const double largest = std::pow(
      hyab(huntLabFromLinear({0.0, 1.0, 0.0}), huntLabFromLinear({0.0, 0.0, 1.0})), kColorExponent);
  Flip result;
  for (std::size_t i = 0; i < a.colors.size(); ++i) {
    const double color = colorDifference(a.colors[i], b.colors[i], largest);
    const double error = std::pow(color, 1.0 - featureDifference(a, b, i));
    result.mean += error;
    result.max = std::max(result.max, error);
    result.map.push_back(float(error));
  }
  result.mean /= double(a.colors.size());
  return result;
}

}  // namespace esvr
