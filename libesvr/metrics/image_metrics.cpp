/// Errors of pictures: PSNR, SSIM and the largest difference; and pictures that are made from pictures.

#include "esvr/image_metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/metrics.h"
#include "field/ssim_window.h"
#include "metrics/shown_pictures.h"

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
