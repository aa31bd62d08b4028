#pragma once
/// A picture in memory.

#include <vector>

namespace esvr {

/// Pixels of red, green, blue and alpha, row by row from the top. Colors are premultiplied by
/// alpha: they are the colors in front of black.
struct Image {
  int width = 0, height = 0;
  std::vector<float> rgba;
};

/// The means of squares of pixels.
/// \param side  side of a square in pixels
/// \throws UsageError  the sides of the picture are not multiples of it
[[nodiscard]] Image meansOfSquares(const Image& image, int side);

}  // namespace esvr
