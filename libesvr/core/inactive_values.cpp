#include "esvr/grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <sstream>

namespace esvr {
namespace {

/// The mixing function of SplitMix64 (Steele, Lea and Flood 2014), made odd, so that no factor of a
/// product makes it 0.
constexpr std::uint64_t mixed(std::uint64_t n) {
  n += 0x9e3779b97f4a7c15u;
  n = (n ^ (n >> 30)) * 0xbf58476d1ce4e5b9u;
  n = (n ^ (n >> 27)) * 0x94d049bb133111ebu;
  return (n ^ (n >> 31)) | 1u;
}

/// The hash of a coordinate is the product of a hash of its block of 128 and of one of its place in
/// the block, so that a tile of 4096 takes 32 steps.
constexpr int kBlockLog2 = 7;
constexpr std::int64_t kEmptyBlockSide = std::int64_t{1} << kBlockLog2;

constexpr std::uint64_t hashInBlock(std::int64_t place, std::uint64_t axis) {
  return mixed((std::uint64_t{1} << 48) + (axis << 32) + std::uint64_t(place));
}
constexpr std::uint64_t sumOfBlock(std::uint64_t axis) {
  std::uint64_t sum = 0;
  for (std::int64_t place = 0; place < kEmptyBlockSide; ++place) sum += hashInBlock(place, axis);
  return sum;
}
/// By axis, from 1.
constexpr std::uint64_t kSumsOfBlock[] = {0, sumOfBlock(1), sumOfBlock(2), sumOfBlock(3)};

/// The sum of the hashes of the coordinates of a side of a box.
std::uint64_t hashesAlong(std::int32_t from, std::int32_t to, std::uint64_t axis) {
  std::uint64_t sum = 0;
  for (std::int64_t c = from; c <= to;) {
    const std::int64_t place = c & (kEmptyBlockSide - 1),
                       end = std::min(c - place + kEmptyBlockSide, to + std::int64_t{1});
    std::uint64_t places = kSumsOfBlock[axis];
    if (end - c < kEmptyBlockSide) {
      places = 0;
      for (std::int64_t i = 0; i < end - c; ++i) places += hashInBlock(place + i, axis);
    }
    sum += mixed((axis << 32) | std::uint32_t(c >> kBlockLog2)) * places;
    c = end;
  }
  return sum;
}

std::uint64_t hashOf(double value) {
  return mixed(std::bit_cast<std::uint64_t>(value == 0.0 ? 0.0 : value));
}

std::string shortText(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

}  // namespace

void InactiveValues::add(double value, const Box& tile) {
  const bool isFirst = count_ == 0, isFirstFinite = count_ == nonFinite_;
  const auto voxels = std::uint64_t(tile.volume());
  count_ += voxels;
  if (isFirst) first_ = tile.min;
  if (!std::isfinite(value)) {
    nonFinite_ += voxels;
  } else {
    min_ = isFirstFinite ? value : std::min(min_, value);
    max_ = isFirstFinite ? value : std::max(max_, value);
  }
  digest_ += hashOf(value) * hashesAlong(tile.min.x, tile.max.x, 1) *
             hashesAlong(tile.min.y, tile.max.y, 2) * hashesAlong(tile.min.z, tile.max.z, 3);
}

void InactiveValues::add(const InactiveValues& others) {
  if (others.count_ == 0) return;
  if (count_ == 0) first_ = others.first_;
  if (others.count_ > others.nonFinite_) {
    const bool hasFinite = count_ > nonFinite_;
    min_ = hasFinite ? std::min(min_, others.min_) : others.min_;
    max_ = hasFinite ? std::max(max_, others.max_) : others.max_;
  }
  count_ += others.count_;
  nonFinite_ += others.nonFinite_;
  digest_ += others.digest_;
}

InactiveValues InactiveValues::ofComponent(std::size_t component) const {
  InactiveValues values = *this;
  values.digest_ *= mixed(component);
  return values;
}

std::string toText(const InactiveValues& values) {
  std::string text = std::to_string(values.count()) +
                     (values.count() == 1 ? " inactive value (" : " inactive values (");
  const std::uint64_t finite = values.count() - values.nonFinite();
  if (finite > 0) text += shortText(values.min());
  if (finite > 0 && values.max() != values.min()) text += " to " + shortText(values.max());
  if (values.nonFinite() > 0)
    text += (finite > 0 ? ", and " : "") + std::to_string(values.nonFinite()) + " NaN or infinite";
  return text + ", first at " + toString(values.first()) + ')';
}

}  // namespace esvr
