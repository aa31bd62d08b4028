#pragma once
/// The states of rays that wait for bricks, in few bytes. The color and the transmittance of a ray are
/// kept in its pixel, which is written when the ray ends. The code is compiled for host and device.

#include <cstdint>

#include "render/brick_march.h"
#include "render/grids_march.h"

namespace esvr {

/// What a RayProgress has besides the channels of its pixel and its shade. Of the last sample that was
/// added, only its value matters, and whether it is the one before the next sample.
struct KeptRay {
  enum class Last : std::uint8_t { kNone, kBefore, kEarlier };

  float lastValue;
  int next;  ///< below 0: the ray has ended
  std::uint8_t level;
  Last last;

  [[nodiscard]] ESVR_HD static KeptRay ended() { return {0.0f, -1, 0, Last::kNone}; }
  ESVR_HD static KeptRay of(const RayProgress& at) {
    const bool isBefore = at.ray.last == std::uint32_t(at.next) - 1;
    const Last last =
        at.ray.last == RayState::kNone ? Last::kNone : (isBefore ? Last::kBefore : Last::kEarlier);
    return {at.ray.lastValue, at.next, std::uint8_t(at.level), last};
  }
  /// \param channels  channelsOf() the ray
  [[nodiscard]] ESVR_HD RayProgress progress(const PixelColor& channels) const {
    RayProgress at;
    at.ray.r = channels.r, at.ray.g = channels.g, at.ray.b = channels.b;
    at.ray.transmittance = channels.alpha;
    at.ray.lastValue = lastValue;
    at.ray.last = last == Last::kNone ? RayState::kNone
                                      : std::uint32_t(next) - (last == Last::kBefore ? 1u : 2u);
    at.next = next, at.level = level;
    return at;
  }
};

/// As KeptRay, for several grids.
struct KeptGridsRay {
  int next;  ///< below 0: the ray has ended
  std::uint32_t inside;
  float last[kMostGrids];

  [[nodiscard]] ESVR_HD static KeptGridsRay ended() { return {-1, 0, {}}; }
  ESVR_HD static KeptGridsRay of(const GridsProgress& at) {
    KeptGridsRay kept{at.next, at.inside, {}};
    for (int g = 0; g < kMostGrids; ++g) kept.last[g] = at.last[g];
    return kept;
  }
  [[nodiscard]] ESVR_HD GridsProgress progress(const PixelColor& channels) const {
    GridsProgress at;
    at.r = channels.r, at.g = channels.g, at.b = channels.b, at.transmittance = channels.alpha;
    at.next = next, at.inside = inside;
    for (int g = 0; g < kMostGrids; ++g) at.last[g] = last[g];
    return at;
  }
};

/// What a pixel holds while its ray waits.
ESVR_HD inline PixelColor channelsOf(const RayProgress& at) {
  return {at.ray.r, at.ray.g, at.ray.b, at.ray.transmittance};
}
ESVR_HD inline PixelColor channelsOf(const GridsProgress& at) {
  return {at.r, at.g, at.b, at.transmittance};
}

}  // namespace esvr
