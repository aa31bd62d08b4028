
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/image.h"

namespace esvr {
namespace {

constexpr int kPixelChannels = 4;

std::size_t offsetOf(const Image& image, int column, int row) {
  return kPixelChannels * (std::size_t(row) * std::size_t(image.width) + std::size_t(column));
}

void addSquare(const Image& image, int side, int column, int row, double (&sums)[kPixelChannels]) {
  for (int y = row * side; y < (row + 1) * side; ++y)
    for (int x = column * side; x < (column + 1) * side; ++x)
      for (int c = 0; c < kPixelChannels; ++c)
        sums[c] += double(image.rgba[offsetOf(image, x, y) + std::size_t(c)]);
}

}  // namespace

Image meansOfSquares(const Image& image, int side) {
  if (side < 1 || image.width % side != 0 || image.height % side != 0)
    throw UsageError("a picture of " + std::to_string(image.width) + " x " +
                     std::to_string(image.height) + " pixels has no squares with a side of " +
                     std::to_string(side));
  Image means{image.width / side, image.height / side, {}};
  means.rgba.resize(offsetOf(means, 0, means.height));
  parallelFor(0, means.height, [&](int row) {
    for (int column = 0; column < means.width; ++column) {
      double sums[kPixelChannels]{};
      addSquare(image, side, column, row, sums);
      for (int c = 0; c < kPixelChannels; ++c)
        means.rgba[offsetOf(means, column, row) + std::size_t(c)] =
            float(sums[c] / (double(side) * double(side)));
    }
  });
  return means;
}

}  // namespace esvr
