/// Volumes of bricks: how they are made, searched and measured; grids of vectors, which are three of them;
/// the index of their bricks; the signs of the empty space of a level set, from its regions, as gaps between
/// bricks along lines, and the votes of the voxels around them; and limits on memory.

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <utility>

#include "core/brick_index.h"
#include "core/memory_budget.h"
#include "core/parallel.h"
#include "esvr/device.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/volume.h"

template class std::vector<float, esvr::VoxelAllocator<float>>;
template class std::vector<std::int32_t, esvr::VoxelAllocator<std::int32_t>>;
template class std::vector<std::byte, esvr::VoxelAllocator<std::byte>>;

namespace esvr {

// Making volumes.

SparseVolume makeVolume(std::vector<BrickInput> bricks, float background) {
  constexpr std::int64_t kMaxExtent = std::int64_t{1} << 31;
  std::erase_if(bricks, [](const BrickInput& b) { return b.active.count() == 0; });
  SparseVolume volume;
  volume.background = background;
  if (bricks.empty()) return volume;

  std::sort(bricks.begin(), bricks.end(),
            [](const BrickInput& a, const BrickInput& b) { return a.corner < b.corner; });
  Coord low = bricks.front().corner;
  for (const auto& brick : bricks) low = minCoord(low, brick.corner);
  for (const auto& brick : bricks) {
    const Coord c = brick.corner;
    const auto extent =
        std::max({std::int64_t(c.x) - low.x, std::int64_t(c.y) - low.y, std::int64_t(c.z) - low.z});
    if (extent >= kMaxExtent - kBrickSide)
      throw BadInput("the active voxels at " + toString(low) + " and " + toString(c) +
                     " are 2^31 voxels or more apart");
  }
  volume.origin = low;

  volume.bricks.reserve(bricks.size());
  volume.active.reserve(bricks.size());
  volume.values.reserve(bricks.size() * kBrickVoxels);
  for (const auto& brick : bricks) {
    const Coord place = brickOf(brick.corner - volume.origin);
    if (!volume.bricks.empty() && volume.bricks.back() == place)
      throw BadInput("two bricks at " + toString(brick.corner));
    volume.bricks.push_back(place);
    volume.active.push_back(brick.active);
    volume.values.insert(volume.values.end(), brick.values.begin(), brick.values.end());
  }
  return volume;
}

void dropInactiveBricks(SparseVolume& volume) {
  std::size_t kept = 0;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    if (volume.active[b].count() == 0) continue;
    if (kept != b) {
      volume.bricks[kept] = volume.bricks[b];
      volume.active[kept] = volume.active[b];
      std::ranges::copy(volume.brickValues(b), volume.brickValues(kept).begin());
    }
    ++kept;
  }
  volume.bricks.resize(kept);
  volume.active.resize(kept);
  volume.values.resize(kept * kBrickVoxels);
  // The origin moves to the smallest corner of the bricks, as in makeVolume.
  Coord low = kept > 0 ? volume.bricks.front() : Coord{};
  for (const Coord b : volume.bricks) low = minCoord(low, b);
  for (Coord& b : volume.bricks) b = b - low;
  volume.origin = kept > 0 ? volume.origin + low * kBrickSide : Coord{};
}

void setBackground(float background, SparseVolume& volume) {
  volume.background = background;
  parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    const auto values = volume.brickValues(b);
    for (int v = 0; v < kBrickVoxels; ++v)
      if (!volume.active[b].test(v)) values[std::size_t(v)] = background;
  });
}

void checkInvariants(const SparseVolume& volume) {
  const std::size_t n = volume.bricks.size();
  if (volume.values.size() != n * kBrickVoxels || volume.active.size() != n)
    throw std::logic_error("SparseVolume: arrays of different length");
  const auto notIncreasing = [](Coord a, Coord b) { return !(a < b); };
  if (std::adjacent_find(volume.bricks.begin(), volume.bricks.end(), notIncreasing) !=
      volume.bricks.end())
    throw std::logic_error("SparseVolume: bricks not in increasing order");
  if (localOf(volume.origin) != Coord{})
    throw std::logic_error("SparseVolume: origin is not a brick corner");
}

// Searching and measuring them.

std::optional<std::size_t> findBrick(const SparseVolume& volume, Coord brick) {
  const auto it = std::lower_bound(volume.bricks.begin(), volume.bricks.end(), brick);
  if (it == volume.bricks.end() || *it != brick) return std::nullopt;
  return std::size_t(it - volume.bricks.begin());
}

std::optional<std::size_t> brickWith(const SparseVolume& volume, Coord voxel) {
  // The difference is formed in bricks, because that of two voxels may exceed 32 bits.
  return findBrick(volume, brickOf(voxel) - brickOf(volume.origin));
}

std::vector<Coord> brickCorners(const SparseVolume& volume) {
  std::vector<Coord> corners;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) corners.push_back(volume.brickCorner(b));
  return corners;
}

SparseVolume withBricks(const SparseVolume& volume, const std::vector<Coord>& corners) {
  SparseVolume result;
  result.background = volume.background;
  result.origin = corners.empty() ? Coord{} : corners.front();
  for (const Coord corner : corners) result.origin = minCoord(result.origin, corner);
  for (const Coord corner : corners)
    result.bricks.push_back(brickOf(corner) - brickOf(result.origin));
  result.values =
      VoxelArray<float>(corners.size() * kBrickVoxels, volume.background, memoryOf(volume));
  result.active.resize(corners.size());
  for (std::size_t b = 0; b < corners.size(); ++b)
    if (const auto own = brickWith(volume, corners[b]))
      std::ranges::copy(volume.brickValues(*own), result.brickValues(b).begin());
  return result;
}

float valueAt(const SparseVolume& volume, Coord voxel) {
  const auto b = brickWith(volume, voxel);
  return b ? volume.brickValues(*b)[voxelOffset(localOf(voxel))] : volume.background;
}

std::uint64_t activeVoxelCount(const SparseVolume& volume) {
  std::uint64_t n = 0;
  for (const auto& mask : volume.active) n += std::uint64_t(mask.count());
  return n;
}

namespace {

/// Adds the active voxels of a brick to a box.
void addActive(const BrickMask& mask, Coord corner, Box& box) {
  std::uint64_t any = 0;  // over all x
  int first = kBrickSide, last = 0;
  for (int x = 0; x < kBrickSide; ++x) {
    any |= mask.words[x];
    if (mask.words[x] == 0) continue;
    first = std::min(first, x);
    last = x;
  }
  if (any == 0) return;
  std::uint64_t line = 0;  // bits of z over all y
  for (int y = 0; y < kBrickSide; ++y) line |= any >> (kBrickSide * y) & 0xff;
  const auto low = [](std::uint64_t bits) { return std::countr_zero(bits); };
  const auto high = [](std::uint64_t bits) { return 63 - std::countl_zero(bits); };
  box.expand(Box{corner + Coord{first, low(any) / kBrickSide, low(line)},
                 corner + Coord{last, high(any) / kBrickSide, high(line)}});
}

/// Expands `none` by all bricks: add(b, result) for each brick.
template <class Result, class Add>
Result overBricks(const SparseVolume& volume, const Result& none, Add add) {
  using BrickRange = tbb::blocked_range<std::size_t>;
  return parallelReduce(
      BrickRange(0, volume.brickCount()), none,
      [&](const BrickRange& bricks, Result result) {
        for (std::size_t b = bricks.begin(); b != bricks.end(); ++b) add(b, result);
        return result;
      },
      [](Result a, const Result& b) {
        a.expand(b);
        return a;
      });
}

}  // namespace

Box activeBox(const SparseVolume& volume) {
  return overBricks(volume, Box{}, [&](std::size_t b, Box& box) {
    addActive(volume.active[b], volume.brickCorner(b), box);
  });
}

namespace {

/// Calls visit(b, v, faces) for each voxel v of the mask of brick b that touches a face of the active box.
template <class Visit>
void forEachOnFaces(const SparseVolume& volume, const Box& box, std::span<const BrickMask> masks,
                    Visit visit) {
  constexpr int kLast = kBrickSide - 1;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    const Coord low = volume.brickCorner(b), high = low + Coord{kLast, kLast, kLast};
    const bool isInside = low.x > box.min.x && low.y > box.min.y && low.z > box.min.z &&
                          high.x < box.max.x && high.y < box.max.y && high.z < box.max.z;
    for (int v = 0; v < kBrickVoxels && !isInside; ++v)
      if (masks[b].test(v))
        if (const unsigned faces = facesOf(box, low + voxelLocal(v))) visit(b, v, faces);
  }
}

}  // namespace

unsigned touchedFaces(const SparseVolume& volume, const Box& box,
                      std::span<const BrickMask> masks) {
  unsigned touched = 0;
  forEachOnFaces(volume, box, masks, [&](std::size_t, int, unsigned faces) { touched |= faces; });
  return touched;
}

std::vector<Coord> boxVoxels(const SparseVolume& volume, const Box& box, unsigned faces) {
  struct Candidate {
    Coord voxel;
    double distance = -1.0;  ///< from the background; below 0: there is no voxel
  };
  std::array<Candidate, kAllFaces + 1> best;  // of the voxels that touch the same faces
  forEachOnFaces(volume, box, volume.active, [&](std::size_t b, int v, unsigned own) {
    const double distance =
        std::abs(double(volume.brickValues(b)[std::size_t(v)]) - volume.background);
    if (distance > best[own].distance)
      best[own] = {volume.brickCorner(b) + voxelLocal(v), distance};
  });
  std::vector<Coord> voxels;
  while (faces != 0) {
    unsigned found = 0;
    int most = 0;
    for (unsigned own = 1; own <= kAllFaces; ++own) {
      const int count = best[own].distance >= 0.0 ? std::popcount(own & faces) : 0;
      const bool isBetter = count == most && best[own].distance > best[found].distance;
      if (count > most || (count > 0 && isBetter)) most = count, found = own;
    }
    if (most == 0) break;  // no voxel is active
    voxels.push_back(best[found].voxel);
    faces &= ~found;
  }
  std::ranges::sort(voxels);
  return voxels;
}

namespace {

/// Expands a range by the finite ones of 64 values, in the lanes of a SIMD vector.
void expandByWord(const float* values, ValueRange& range) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  constexpr int kLanes = 8;
  float low[kLanes], high[kLanes];
  std::fill_n(low, kLanes, range.min);
  std::fill_n(high, kLanes, range.max);
  for (int v = 0; v < 64; v += kLanes)
    for (int k = 0; k < kLanes; ++k) {
      const float value = values[v + k];
      low[k] = value < low[k] && value >= -kLargest ? value : low[k];
      high[k] = value > high[k] && value <= kLargest ? value : high[k];
    }
  for (int k = 0; k < kLanes; ++k)
    range.min = std::min(range.min, low[k]), range.max = std::max(range.max, high[k]);
}

}  // namespace

ValueRange activeRange(const SparseVolume& volume) {
  const ValueRange range =
      overBricks(volume, ValueRange::none(), [&](std::size_t b, ValueRange& result) {
        const float* values = volume.brickValues(b).data();
        for (const std::uint64_t word : volume.active[b].words) {
          if (word == ~std::uint64_t{0})
            expandByWord(values, result);
          else
            for (std::uint64_t left = word; left != 0; left &= left - 1)
              if (const float value = values[std::countr_zero(left)]; std::isfinite(value))
                result.expand(value);
          values += 64;
        }
      });
  if (range.min <= range.max) return range;
  if (activeVoxelCount(volume) == 0) throw BadInput("the grid has no active voxel");
  return {volume.background, volume.background};
}

bool hasNonFinite(const SparseVolume& volume) {
  std::atomic<bool> found{false};
  parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    if (found.load(std::memory_order_relaxed)) return;
    const auto values = volume.brickValues(b);
    bool areFinite = true;
    for (const float value : values) areFinite &= std::isfinite(value);
    if (!areFinite) found.store(true, std::memory_order_relaxed);
  });
  return found;
}

void dropNonFinite(SparseVolume& volume) {
  parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    const auto values = volume.brickValues(b);
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (std::isfinite(values[std::size_t(v)])) continue;
      values[std::size_t(v)] = volume.background;
      volume.active[b].reset(v);
    }
  });
}

bool isConstant(const ValueRange& values) {
  constexpr double kFewRoundings = 0x1p-22;
  const double low = values.min, high = values.max;
  return high - low <= kFewRoundings * std::max(std::abs(low), std::abs(high));
}

ValueSpan spanOf(const ValueRange& active, double background) {
  const double low = active.min, high = active.max;
  const double gap = std::max({low - background, background - high, 0.0});
  const bool isNear = isConstant(active) ? std::isfinite(background) : gap <= high - low;
  if (!isNear) return {low, high, true};
  return {std::min(low, background), std::max(high, background), false};
}

ValueSpan spanOf(const SparseVolume& volume) {
  return spanOf(activeRange(volume), volume.background);
}

double peakOf(const ValueRange& active, double background) {
  const double low = active.min, high = active.max;
  if (isConstant(active)) return low == 0.0 ? 1.0 : std::max(std::abs(low), std::abs(high));
  if (low < 0.0 && high > 0.0) return std::max(-low, high);
  const ValueSpan span = spanOf(active, background);
  return low >= 0.0 ? high - std::max(span.low, 0.0) : std::min(span.high, 0.0) - low;
}

// Grids of vectors.

namespace {

float lengthOf(double x, double y, double z) { return float(std::sqrt(x * x + y * y + z * z)); }

}  // namespace

std::string componentName(const std::string& grid, std::size_t component) {
  constexpr std::array kAxisNames{'x', 'y', 'z'};
  return grid + '.' + kAxisNames.at(component);
}

VectorVolume aligned(const VectorVolume& vectors) {
  std::vector<Coord> corners;  // of all bricks of the components, increasing
  for (const SparseVolume& volume : vectors)
    for (std::size_t b = 0; b < volume.brickCount(); ++b) corners.push_back(volume.brickCorner(b));
  std::ranges::sort(corners);
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  VectorVolume result;
  for (std::size_t c = 0; c < kComponents; ++c) result[c] = withBricks(vectors[c], corners);
  for (std::size_t b = 0; b < corners.size(); ++b) {
    BrickMask any;
    for (const SparseVolume& volume : vectors)
      if (const auto own = brickWith(volume, corners[b]))
        for (std::size_t w = 0; w < any.words.size(); ++w)
          any.words[w] |= volume.active[*own].words[w];
    for (SparseVolume& volume : result) volume.active[b] = any;
  }
  return result;
}

SparseVolume magnitudeOf(const VectorVolume& vectors) {
  const VectorVolume all = aligned(vectors);
  const SparseVolume &x = all[0], &y = all[1], &z = all[2];  // a lambda cannot capture bindings
  SparseVolume result = x;
  result.background = lengthOf(x.background, y.background, z.background);
  parallelFor(std::size_t{0}, result.values.size(), [&](std::size_t v) {
    result.values[v] = lengthOf(x.values[v], y.values[v], z.values[v]);
  });
  return result;
}

// The index of bricks.

BrickIndex::BrickIndex(std::span<const Coord> bricks) {
  add(bricks);
  rehash();
}

void BrickIndex::add(std::span<const Coord> bricks) {
  if (bricks_.size() + bricks.size() >= kNone)
    throw RuntimeFailure("there are 2^32 bricks or more");
  bricks_.insert(bricks_.end(), bricks.begin(), bricks.end());
  for (const Coord brick : bricks) bounds_.expand(brick);
}

void BrickIndex::append(std::span<const Coord> bricks) {
  const std::size_t first = bricks_.size();
  add(bricks);
  if (2 * bricks_.size() > slots_.size()) return rehash();
  for (std::size_t b = first; b < bricks_.size(); ++b) insert(std::uint32_t(b));
}

void BrickIndex::insert(std::uint32_t position) {
  std::size_t slot = hash(bricks_[position]) & mask_;
  while (slots_[slot] != kNone) slot = (slot + 1) & mask_;
  slots_[slot] = position;
}

void BrickIndex::rehash() {
  slots_.assign(std::bit_ceil(4 * bricks_.size() + 8), kNone);
  mask_ = slots_.size() - 1;
  for (std::size_t b = 0; b < bricks_.size(); ++b) insert(std::uint32_t(b));
}

}  // namespace esvr

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

// ---- Limits on memory

namespace esvr {

std::string byteText(double bytes) {
  constexpr double kMega = 1e6, kGiga = 1e9;
  char text[32];
  if (bytes < kGiga)
    std::snprintf(text, sizeof text, "%.3g MB", bytes / kMega);
  else
    std::snprintf(text, sizeof text, "%.3g GB", bytes / kGiga);
  return text;
}

std::uint64_t usualMemoryLimit() {
#ifdef __EMSCRIPTEN__
  return kNoMemoryLimit;  // the pages below would be those that the module has now, and it gets more
#endif
  const long pages = ::sysconf(_SC_PHYS_PAGES), pageBytes = ::sysconf(_SC_PAGESIZE);
  if (pages <= 0 || pageBytes <= 0) return kNoMemoryLimit;  // the system does not tell
  return std::uint64_t(pages) * std::uint64_t(pageBytes) / 2;
}

void requireWithinMemory(double neededBytes, std::uint64_t maxBytes, const std::string& what) {
  if (neededBytes <= double(maxBytes)) return;
  throw MemoryExceeded(what + " asks for up to " + byteText(neededBytes) + " of memory, and " +
                       byteText(double(maxBytes)) + " are allowed");
}

}  // namespace esvr
