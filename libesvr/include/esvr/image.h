#pragma once
/// A picture in memory.

#include <vector>

namespace esvr {

/// Red, green, blue, alpha a pixel, row after row from the top. Premultiplied: the colors are those
/// in front of black.
struct Image {
  int width = 0, height = 0;
  std::vector<float> rgba;
};

}  // namespace esvr
