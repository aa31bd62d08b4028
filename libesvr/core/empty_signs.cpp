/// The signs of the empty space of a level set: its regions, as gaps between bricks along lines, and the
/// votes of the voxels around them.

#include "esvr/volume.h"

#include <algorithm>
#include <array>
#include <utility>

namespace esvr {
namespace {

constexpr std::size_t kBeyond = 0;  // the gap that reaches infinity

constexpr std::array<Coord, 6> kFaces{Coord{-1, 0, 0}, Coord{1, 0, 0},  Coord{0, -1, 0},
                                      Coord{0, 1, 0},  Coord{0, 0, -1}, Coord{0, 0, 1}};

/// Steps to the lines beside a line along z.
constexpr std::array<std::pair<int, int>, 4> kBeside{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};

/// True if a voxel of a brick touches the brick at the given step.
bool touches(Coord local, Coord step) {
  const auto atSide = [](std::int32_t l, std::int32_t s) {
    return s == 0 || l == (s < 0 ? 0 : kBrickSide - 1);
  };
  return atSide(local.x, step.x) && atSide(local.y, step.y) && atSide(local.z, step.z);
}

/// Number of negative voxels of the slice of a brick that touches the brick at the given step.
std::int64_t negativeAt(std::span<const float> values, Coord step) {
  std::int64_t negative = 0;
  for (int v = 0; v < kBrickVoxels; ++v)
    negative += values[v] < 0.0f && touches(voxelLocal(v), step);
  return negative;
}

}  // namespace

EmptySigns::EmptySigns(const SparseVolume& volume) : origin_(brickOf(volume.origin)), gaps_(1) {
  findGaps(volume);
  joinGaps();
  countFaces(volume);
  judge();
}

void EmptySigns::findGaps(const SparseVolume& volume) {
  for (const Coord brick : volume.bricks) {
    if (lines_.empty() || lines_.back().x != brick.x || lines_.back().y != brick.y)
      lines_.push_back({brick.x, brick.y, brick.z, brick.z, gaps_.size(), gaps_.size()});
    Line& line = lines_.back();
    if (brick.z > line.last + 1) gaps_.push_back({line.last + 1, brick.z - 1, gaps_.size()});
    line.last = brick.z;
    line.gapsEnd = gaps_.size();
  }
}

void EmptySigns::joinGaps() {
  for (const Line& line : lines_)
    for (std::size_t gap = line.gapsBegin; gap < line.gapsEnd; ++gap)
      for (const auto& [x, y] : kBeside) join(gap, lineAt(line.x + x, line.y + y));
}

/// Unites a gap with the empty places of a line beside its own; null: the line has no brick.
void EmptySigns::join(std::size_t gap, const Line* beside) {
  const auto [first, last] = std::pair{gaps_[gap].first, gaps_[gap].last};
  if (!beside || first < beside->first || last > beside->last) unite(gap, kBeyond);
  if (!beside) return;
  for (std::size_t g = firstGapFrom(*beside, first); g < beside->gapsEnd; ++g) {
    if (gaps_[g].first > last) break;
    unite(gap, g);
  }
}

void EmptySigns::unite(std::size_t a, std::size_t b) {
  a = rootOf(a);
  b = rootOf(b);
  gaps_[std::max(a, b)].region = std::min(a, b);
}

std::size_t EmptySigns::rootOf(std::size_t gap) const {
  while (gaps_[gap].region != gap) gap = gaps_[gap].region;
  return gap;
}

const EmptySigns::Line* EmptySigns::lineAt(std::int32_t x, std::int32_t y) const {
  const auto at = std::lower_bound(lines_.begin(), lines_.end(), std::pair{x, y},
                                   [](const Line& line, const auto& place) {
                                     return std::pair{line.x, line.y} < place;
                                   });
  return at != lines_.end() && at->x == x && at->y == y ? &*at : nullptr;
}

/// The first gap of a line that ends at z or above.
std::size_t EmptySigns::firstGapFrom(const Line& line, std::int32_t z) const {
  const auto begin = gaps_.begin();
  return std::size_t(
      std::lower_bound(begin + std::ptrdiff_t(line.gapsBegin), begin + std::ptrdiff_t(line.gapsEnd),
                       z, [](const Gap& gap, std::int32_t at) { return gap.last < at; }) -
      begin);
}

/// The gap of a place without a brick. \param brick  relative to the volume's origin
std::size_t EmptySigns::gapAt(Coord brick) const {
  const Line* line = lineAt(brick.x, brick.y);
  if (!line || brick.z < line->first || brick.z > line->last) return kBeyond;
  return rootOf(firstGapFrom(*line, brick.z));
}

void EmptySigns::countFaces(const SparseVolume& volume) {
  for (Gap& gap : gaps_) gap.region = rootOf(std::size_t(&gap - gaps_.data()));
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (const Coord step : kFaces) {
      const Coord place = volume.bricks[b] + step;
      if (findBrick(volume, place)) continue;
      const std::int64_t negative = negativeAt(volume.brickValues(b), step);
      Gap& region = gaps_[gapAt(place)];
      region.inside += negative;
      region.outside += kBrickSide * kBrickSide - negative;
    }
}

void EmptySigns::judge() {
  agree_ = gaps_[kBeyond].inside == 0;
  for (const Gap& gap : gaps_) agree_ = agree_ && (gap.inside == 0 || gap.outside == 0);
}

bool EmptySigns::isInside(Coord brick) const {
  const std::size_t gap = gapAt(brick - origin_);
  return gap != kBeyond && gaps_[gap].inside > gaps_[gap].outside;
}

}  // namespace esvr
