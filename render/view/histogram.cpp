#include "render/view/histogram.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>

#include "render/view/binary_message.h"

namespace esvr::view {
namespace {

/// The part of the range in which a value counts.
class Bins {
 public:
  explicit Bins(ValueRange range)
      : low_(range.min),
        perUnit_(range.max > range.min ? double(kHistogramBins) / (double(range.max) - range.min)
                                       : 0.0) {}
  [[nodiscard]] std::size_t at(float value) const {
    const double place = (double(value) - low_) * perUnit_;
    return std::size_t(std::clamp(place, 0.0, double(kHistogramBins - 1)));
  }

 private:
  double low_, perUnit_;
};

}  // namespace

std::vector<std::uint64_t> histogramOf(const SparseVolume& volume, ValueRange range) {
  const Bins bins(range);
  std::vector<std::uint64_t> counts(kHistogramBins);
  for (std::size_t brick = 0; brick < volume.brickCount(); ++brick) {
    const std::span<const float> values = volume.brickValues(brick);
    for (int offset = 0; offset < kBrickVoxels; ++offset)
      if (volume.active[brick].test(offset)) ++counts[bins.at(values[std::size_t(offset)])];
  }
  return counts;
}

std::string histogramMessage(const GridPlace& place, ValueRange range,
                             const std::vector<std::uint64_t>& counts) {
  nlohmann::json content{
      {"type", "histogram"},
      {"file", place.file},
      {"grid", place.grid},
      {"frame", nullptr},
      {"histogram", {{"low", range.min}, {"high", range.max}, {"counts", counts}}}};
  if (place.frame) content["frame"] = *place.frame;
  return textOf(content);
}

}  // namespace esvr::view
