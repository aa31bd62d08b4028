#pragma once
/// Pictures as metrics see them.

#include "esvr/image.h"

namespace esvr::metrics {

inline constexpr int kChannels = 4, kColors = 3;  ///< of a pixel

/// \throws UsageError  the pictures have no pixel or differ in size
void requireEqualSizes(const Image& reference, const Image& candidate);

/// The value of a color as a screen shows it, clamped to 0 to 1.
/// \throws BadInput  it is not a number
[[nodiscard]] double shownValue(float value);

}  // namespace esvr::metrics
