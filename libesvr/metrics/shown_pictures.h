#pragma once
/// Pictures as the metrics of pictures see them.

#include <algorithm>
#include <cmath>
#include <string>

#include "esvr/error.h"
#include "esvr/image.h"

namespace esvr::metrics {

inline constexpr int kChannels = 4, kColors = 3;  ///< of a pixel

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
