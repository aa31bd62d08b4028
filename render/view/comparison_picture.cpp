#include "render/view/comparison_picture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace esvr::view {
namespace {

constexpr std::size_t kChannels = 4;

Image splitPicture(const Image& image, Image picture, double split) {
  const std::size_t row = kChannels * std::size_t(image.width);
  const std::size_t left = kChannels * std::size_t(std::lround(split * image.width));
  for (std::size_t i = 0; i < image.rgba.size(); i += row)
    std::copy_n(&image.rgba[i], left, &picture.rgba[i]);
  return picture;
}

Image differencePicture(const Image& image, Image picture, double gain) {
  for (std::size_t i = 0; i < picture.rgba.size(); ++i)
    picture.rgba[i] = i % kChannels == kChannels - 1
                          ? 1.0f
                          : float(gain) * std::abs(picture.rgba[i] - image.rgba[i]);
  return picture;
}

}  // namespace

Image comparisonPicture(const Image& image, const Image& reference, const Comparison& comparison) {
  switch (comparison.show) {
    case CompareShow::kSplit:
      return splitPicture(image, reference, comparison.split);
    case CompareShow::kDifference:
      return differencePicture(image, reference, comparison.gain);
    case CompareShow::kReference:
      break;
  }
  return reference;
}

}  // namespace esvr::view
