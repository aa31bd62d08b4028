#pragma once
/// Marches a ray through bricks of cells and their levels of detail. A brick holds all voxels at
/// the corners of its cells, so that the interpolation of a sample reads one brick only. A ray
/// crosses an empty brick, or an empty block of bricks, in one step. A ray that meets a brick whose
/// voxels are not there stops, and can continue later. Where a pixel is wider than a voxel, a ray
/// is sampled in a coarser level and at longer steps. The code is compiled for host and device.

#include <array>
#include <bit>
#include <cstdint>

#include "render/sample_rule.h"

namespace esvr {

// Bricks.

/// A brick has 8 x 8 x 8 cells and stores the 9 x 9 x 9 voxels at their corners, z fastest.
inline constexpr int kCellBrickSide = kBrickSide + 1;
inline constexpr int kCellBrickVoxels = kCellBrickSide * kCellBrickSide * kCellBrickSide;
/// A brick is found through its block, which has 8 x 8 x 8 bricks.
inline constexpr int kBlockBricks = 8;
inline constexpr int kBlockSide = kBlockBricks * kBrickSide;  ///< voxels
inline constexpr int kBricksOfBlock = kBlockBricks * kBlockBricks * kBlockBricks;
inline constexpr std::uint32_t kNoCells = 0xffffffffu;

/// Bricks of a block that follow each other (z fastest).
struct alignas(16) BrickRow {
  static constexpr int kLength = 64;

  std::uint64_t there;  ///< bit i is set if brick i has a number
  std::uint32_t first;  ///< number of the first brick that has one; the others follow in order
};
inline constexpr int kRowsOfBlock = kBricksOfBlock / BrickRow::kLength;
static_assert(BrickRow::kLength == kBlockBricks * kBlockBricks, "a row has the bricks of one x");

/// Numbers the bricks of cells. Pointers are to host or device memory.
struct BrickTableView {
  Coord origin;                  ///< first voxel of the first block
  Coord blocks;                  ///< number of blocks along each axis
  const std::uint32_t* blockOf;  ///< number of each block, or kNoCells; z fastest
  const BrickRow* rows;          ///< kRowsOfBlock for each block
};

/// The voxels of bricks. They lie in slots, and the slots in pages.
struct BrickSlotsView {
  static constexpr int kPageLog2 = 8;
  static constexpr std::uint32_t kPageSlots = 1u << kPageLog2;
  static constexpr std::size_t kPageFloats = std::size_t(kPageSlots) * kCellBrickVoxels;
  /// Values of slotOf for bricks without a slot.
  static constexpr std::uint32_t kVacant = 0xffffffffu;   ///< all voxels are the background
  static constexpr std::uint32_t kMissing = 0xfffffffeu;  ///< the voxels are not there
  static constexpr std::uint32_t kAsked = 0xfffffffdu;    ///< as kMissing, and already asked for

  const std::uint32_t* slotOf;  ///< by brick; null: brick n has slot n
  const float* const* pages;    ///< kPageFloats values each

  /// Slot of a brick, or kVacant, kMissing or kAsked.
  [[nodiscard]] ESVR_HD std::uint32_t slot(std::uint32_t brick) const {
    return slotOf == nullptr ? brick : slotOf[brick];
  }
  [[nodiscard]] ESVR_HD static bool hasSlot(std::uint32_t slot) { return slot < kAsked; }
  [[nodiscard]] ESVR_HD const float* values(std::uint32_t slot) const {
    return pages[slot >> kPageLog2] + std::size_t(slot & (kPageSlots - 1)) * kCellBrickVoxels;
  }
};

namespace brick_march {

/// The brick that has a cell, or the empty cube around the cell: a brick or a whole block.
struct Found {
  std::uint32_t brick;  ///< kNoCells: empty
  Coord low;            ///< lowest corner of the brick or cube, a multiple of its side
  int side;             ///< a power of two

  [[nodiscard]] ESVR_HD bool contains(const Coord& cell) const {
    return (((cell.x ^ low.x) | (cell.y ^ low.y) | (cell.z ^ low.z)) & ~(side - 1)) == 0;
  }
};
/// An empty cube of one cell.
ESVR_HD inline Found nothingAt(const Coord& cell) { return {kNoCells, cell, 1}; }

ESVR_HD inline std::uint32_t countBits(std::uint64_t word) {
#ifdef __CUDA_ARCH__
  return std::uint32_t(__popcll(word));
#else
  return std::uint32_t(std::popcount(word));
#endif
}

/// The number of a brick of a row, or kNoCells.
ESVR_HD inline std::uint32_t numberIn(const BrickRow& row, int brick) {
  const std::uint64_t bit = std::uint64_t{1} << brick;
  return (row.there & bit) == 0 ? kNoCells : row.first + countBits(row.there & (bit - 1));
}

/// \param v  cell relative to the table's origin; it must lie within the blocks
ESVR_HD inline Found find(const BrickTableView& a, const Coord& v) {
  constexpr int kBlockLog2 = 6, kMask = kBlockBricks - 1;
  static_assert(kBlockSide == 1 << kBlockLog2);
  const Coord block{v.x >> kBlockLog2, v.y >> kBlockLog2, v.z >> kBlockLog2};
  const std::uint32_t number = a.blockOf[(block.x * a.blocks.y + block.y) * a.blocks.z + block.z];
  if (number == kNoCells)
    return {kNoCells,
            {block.x << kBlockLog2, block.y << kBlockLog2, block.z << kBlockLog2},
            kBlockSide};
  const Coord brick{v.x >> kBrickLog2, v.y >> kBrickLog2, v.z >> kBrickLog2};
  const BrickRow row = a.rows[number * kRowsOfBlock + std::uint32_t(brick.x & kMask)];
  return {numberIn(row, (brick.y & kMask) * kBlockBricks + (brick.z & kMask)),
          {brick.x << kBrickLog2, brick.y << kBrickLog2, brick.z << kBrickLog2},
          kBrickSide};
}

ESVR_HD inline float between(float a, float b, float s) { return a + s * (b - a); }

/// \param values  voxels of the brick
ESVR_HD inline float interpolate(const float* values, const FloatPlace& p, const Coord& cell) {
  constexpr int kMask = kBrickSide - 1, kX = kCellBrickSide * kCellBrickSide, kY = kCellBrickSide;
  const float* v = values + (cell.x & kMask) * kX + (cell.y & kMask) * kY + (cell.z & kMask);
  const float x = p.x - float(cell.x), y = p.y - float(cell.y), z = p.z - float(cell.z);
  const float low = between(between(v[0], v[1], z), between(v[kY], v[kY + 1], z), y);
  const float high =
      between(between(v[kX], v[kX + 1], z), between(v[kX + kY], v[kX + kY + 1], z), y);
  return between(low, high, x);
}

/// The gradient of the values of a brick. \param low  lowest corner of the brick
ESVR_HD inline FloatPlace gradientIn(const float* values, const FloatPlace& p, const Coord& low) {
  const FloatPlace local{p.x - float(low.x), p.y - float(low.y), p.z - float(low.z)};
  constexpr int kLast = kBrickSide - 1;
  const auto cellAt = [](float at) { return at < float(kLast) ? int(at) : kLast; };
  return gradientAt(local, float(kBrickSide), [&](const FloatPlace& at) {
    return interpolate(values, at, {cellAt(at.x), cellAt(at.y), cellAt(at.z)});
  });
}

/// The largest integer that is not above a coordinate. Not every x86-64 processor has an instruction for
/// std::floor().
ESVR_HD inline int wholeBelow(float at) {
#ifdef __CUDA_ARCH__
  return int(floorf(at));
#else
  const int whole = int(at);
  return whole - int(float(whole) > at);
#endif
}

ESVR_HD inline Coord cellOf(const FloatPlace& p) {
  return {wholeBelow(p.x), wholeBelow(p.y), wholeBelow(p.z)};
}

ESVR_HD inline bool inside(const BrickTableView& a, const Coord& v) {
  // Negative numbers become too large ones.
  return std::uint32_t(v.x) < std::uint32_t(a.blocks.x * kBlockSide) &&
         std::uint32_t(v.y) < std::uint32_t(a.blocks.y * kBlockSide) &&
         std::uint32_t(v.z) < std::uint32_t(a.blocks.z * kBlockSide);
}

}  // namespace brick_march

// The march through the bricks of one level.

/// A ray whose first samples have been added.
struct RayProgress {
  RayState ray;
  RayParts parts;
  int next = 0;   ///< part of the first sample that has not been added
  int level = 0;  ///< place of that sample's level in a LevelScene
  Shade shade;    ///< at the last sample that was added; used if the scene is shaded
};

/// What a RayProgress has besides the channels of its pixel and its shade, in few bytes. A ray that
/// waits for bricks keeps its color and its transmittance in its pixel, which is written when the
/// ray ends. The last sample that was added is the one before the next, or there is none because
/// the ray is in empty space.
struct KeptRay {
  float lastValue, change;
  int next;  ///< below 0: the ray has ended
  std::uint8_t level;
  bool divided, hasLast;

  [[nodiscard]] ESVR_HD static KeptRay ended() { return {0.0f, 0.0f, -1, 0, false, false}; }
  ESVR_HD static KeptRay of(const RayProgress& at) {
    return {at.ray.lastValue,       at.parts.change,  at.next,
            std::uint8_t(at.level), at.parts.divided, at.ray.last != RayState::kNone};
  }
  /// \param channels  channelsOf() the ray
  [[nodiscard]] ESVR_HD RayProgress progress(const PixelColor& channels) const {
    RayProgress at;
    at.ray.r = channels.r, at.ray.g = channels.g, at.ray.b = channels.b;
    at.ray.transmittance = channels.alpha;
    at.ray.lastValue = lastValue;
    at.parts = {change, divided};
    if (hasLast) at.ray.last = std::uint32_t(next - at.parts.apart());
    at.next = next, at.level = level;
    return at;
  }
};
/// What the pixel of a ray that waits holds.
ESVR_HD inline PixelColor channelsOf(const RayProgress& at) {
  return {at.ray.r, at.ray.g, at.ray.b, at.ray.transmittance};
}

/// The visitor of a march whose bricks all have slots or are vacant.
struct AllBricksAreThere {
  ESVR_HD void entered(std::uint32_t) const {}
  ESVR_HD bool wantsMore(std::uint32_t, std::uint32_t) const { return false; }
};

/// A sample and where its value comes from.
struct BrickSample {
  const float* values;  ///< of the brick; not used if the value is the background
  Coord low;            ///< lowest corner of the brick
  FloatPlace place;
  float value;
  SampleNumber number;
};

/// Adds samples whose colors are not lit.
struct UnlitSamples {
  ESVR_HD void add(const SampleRule& rule, const BrickSample& sample, RayProgress& at) const {
    rule.add(at.ray, sample.value, sample.number);
  }
  ESVR_HD void addEmpty(const SampleRule& rule, float length, RayProgress& at) const {
    rule.addEmpty(at.ray, NoShades{}, length);
  }
};
/// Adds samples whose colors are lit by their gradients.
struct LitSamples {
  LightRule light;
  FloatPlace direction;  ///< of the ray in the camera's space, of unit length

  ESVR_HD void add(const SampleRule& rule, const BrickSample& sample, RayProgress& at) const {
    const FloatPlace gradient = brick_march::gradientIn(sample.values, sample.place, sample.low);
    const Shade shade = light.shadeOf(gradient, direction);
    rule.add(at.ray, sample.value, sample.number, Shades{at.shade, shade});
    at.shade = shade;
  }
  ESVR_HD void addEmpty(const SampleRule& rule, float length, RayProgress& at) const {
    rule.addEmpty(at.ray, Shades{at.shade, at.shade}, length);
  }
};

namespace brick_march {

/// Adds a sample, which may be empty space, or begins to divide the segment before it. It is inlined
/// because the rule's mode is known where it is called.
/// \return the part of the next sample to add
template <class Adding>
[[gnu::always_inline]] ESVR_HD inline int addSample(const SampleRule& rule,
                                                    const BrickSample& sample, int part,
                                                    RayProgress& at, const Adding& adding) {
  const SampleNumber& number = sample.number;
  if (rule.bends(at.ray, at.parts, number, sample.value)) return at.parts.divide(part);
  if (sample.value != rule.background) {
    const float before = rule.valueBefore(at.ray, number);
    adding.add(rule, sample, at);
    at.parts.change = (sample.value - before) * (at.parts.divided ? float(kSegmentParts) : 1.0f);
  } else if (at.ray.last != RayState::kNone) {
    adding.addEmpty(rule, number.length, at);
  }
  return at.parts.next(part);
}

}  // namespace brick_march

/// Adds samples to a ray until it ends or meets a brick that is missing.
/// \param scene    its box and view are relative to the table's origin
/// \param slots    BrickSlotsView, or a type with the same functions
/// \param visitor  entered(slot) is called for each slot that the ray reads. wantsMore(brick, slot)
///                 is called for each missing brick; while it returns true, the march looks for
///                 further missing bricks on the ray, without adding samples
/// \param adding   UnlitSamples or LitSamples
/// \return true if the ray has ended
template <class Slots, class Visitor, class Adding = UnlitSamples>
ESVR_HD inline bool marchBricks(const BrickTableView& table, const Slots& slots,
                                const MarchScene& scene, const MarchSamples& samples,
                                RayProgress& at, Visitor& visitor, const Adding& adding = {}) {
  using namespace brick_march;
  Found found = nothingAt({-1, -1, -1});
  const float* values = nullptr;
  bool looksAhead = false;
  if (at.next == 0 && at.ray.last != RayState::kNone &&
      at.ray.last + kSegmentParts != std::uint32_t(samples.firstPart()))
    adding.addEmpty(scene.rule, 1.0f, at);  // of another level, with empty space behind it
  for (int part = at.next > 0 ? at.next : samples.start(at.parts);
       part <= samples.lastPart && scene.rule.open(at.ray);) {
    const FloatPlace place = samples.at(part);
    const Coord cell = cellOf(place);
    if (!found.contains(cell)) {
      // Rounding can move a place beyond the box.
      found = inside(table, cell) ? find(table, cell) : nothingAt(cell);
      const std::uint32_t slot =
          found.brick == kNoCells ? BrickSlotsView::kVacant : slots.slot(found.brick);
      const bool there = slots.hasSlot(slot);
      values = there && !looksAhead ? slots.values(slot) : nullptr;
      if (there && !looksAhead) visitor.entered(slot);
      if (!there && slot != BrickSlotsView::kVacant) {
        if (!looksAhead) at.next = part;
        looksAhead = true;
        if (!visitor.wantsMore(found.brick, slot)) return false;
      }
    }
    // In empty space, a ray that has left its last sample and divides no segment skips samples.
    if (looksAhead || (values == nullptr && at.ray.last == RayState::kNone && !at.parts.divided)) {
      part += kSegmentParts * samplesToLeave(place, samples.perVoxel, found.low, found.side);
      continue;
    }
    const float value = values != nullptr && samples.inside(part) ? interpolate(values, place, cell)
                                                                  : scene.rule.background;
    const SampleNumber number = samples.numberOf(part, at.parts.apart());
    part = addSample(scene.rule, {values, found.low, place, value, number}, part, at, adding);
  }
  return !looksAhead;
}

// Levels of detail. A voxel of level l is the mean of the 2^l x 2^l x 2^l voxels from 2^l (i, j, k)
// on, and lies in the middle of them.

/// Levels 0 to kLevels - 1. Pixels that are wider than a voxel of the coarsest level use it too.
inline constexpr int kLevels = 8;

/// The mean of two values. Neither a value nor its mean with itself overflows or is rounded.
ESVR_HD inline float meanOf(float a, float b) { return 0.5f * a + 0.5f * b; }

/// The mean of eight voxels by the numbers of their corners (core/geometry.h). All code that
/// averages uses it, level after level, so that voxels have the same bits however they were made.
ESVR_HD inline float meanOf(const float (&v)[8]) {
  return meanOf(meanOf(meanOf(v[0], v[1]), meanOf(v[2], v[3])),
                meanOf(meanOf(v[4], v[5]), meanOf(v[6], v[7])));
}

/// The voxels of a level in units of those of level 0.
struct LevelFrame {
  int level;

  [[nodiscard]] ESVR_HD double side() const { return double(1 << level); }
  /// Place of voxel (0, 0, 0) along each axis.
  [[nodiscard]] ESVR_HD double offset() const { return 0.5 * (side() - 1.0); }
  /// Converts a place to the index space of the level.
  [[nodiscard]] ESVR_HD Vec3 place(const Vec3& p) const {
    const double perSide = 1.0 / side(), o = offset();
    return {(p[0] - o) * perSide, (p[1] - o) * perSide, (p[2] - o) * perSide};
  }
};

/// The view, clip box and rule of a scene in the index space of a level, relative to an origin
/// there. Sample n of the level is sample n 2^level of level 0.
/// \param scene   in the index space of level 0; its rule's table is not changed
/// \param origin  a voxel of the level
ESVR_HD inline MarchScene sceneOfLevel(const MarchScene& scene, LevelFrame frame,
                                       const Coord& origin) {
  const Vec3 from = pointOf(origin);
  MarchScene s = scene;
  const double perSide = 1.0 / frame.side();
  s.view.eye = difference(frame.place(scene.view.eye), from);
  s.view.before *= perSide;
  if (!s.view.perspective) {
    s.view.pixel *= perSide, s.view.left *= perSide, s.view.top *= perSide;
  }
  s.clip.box = {difference(frame.place(scene.clip.box.low), from),
                difference(frame.place(scene.clip.box.high), from)};
  s.rule.step *= float(frame.side());
  return s;
}

/// The samples of a picture's rays that are drawn in each level. Samples have the numbers of level
/// 0. Level l begins at sample begin[l], a multiple of 2^l, and ends where level l + 1 begins.
struct LevelBounds {
  std::array<double, kLevels + 1> begin;
  int first = 0, last = 0;  ///< levels that rays may meet in the box of the volume

  [[nodiscard]] ESVR_HD bool oneLevel() const { return first == last; }
};

/// The bricks of cells of a level, and what rays need in it.
struct LevelView {
  BrickTableView table;        ///< in the voxels of the level
  PlaceBox box;                ///< box of the cells, relative to the table's origin
  TransferTableView transfer;  ///< for the steps of the level
};

struct LevelScene {
  MarchScene scene;  ///< in the index space of level 0; its box and table are not used
  LevelBounds bounds;
  LevelView levels[kLevels];  ///< from bounds.first to bounds.last

  /// \param place  0 for the level bounds.first, 1 for the next one, and so on
  [[nodiscard]] ESVR_HD LevelFrame frame(int place) const { return {bounds.first + place}; }
  /// The scene of a level, relative to the origin of its table.
  [[nodiscard]] ESVR_HD MarchScene at(int place) const {
    MarchScene s = sceneOfLevel(scene, frame(place), levels[place].table.origin);
    s.box = levels[place].box;
    s.rule.table = levels[place].transfer;
    return s;
  }
  /// The place of the coarsest level.
  [[nodiscard]] ESVR_HD int last() const { return bounds.last - bounds.first; }
};

/// What is known about a scene when code is compiled, which is then faster.
struct MarchCode {
  bool hasOneLevel = false;
  bool isUsual = false;  ///< RenderMode::kComposite and Classification::kPreIntegrated
  bool isShaded = false;
};
/// What is known about a scene.
[[nodiscard]] inline MarchCode codeFor(const LevelScene& s) {
  return {s.bounds.oneLevel(),
          s.scene.rule.mode == RenderMode::kComposite &&
              s.scene.rule.classification == Classification::kPreIntegrated,
          s.scene.isShaded};
}

namespace level_march {

/// Samples of level 0 as samples of another level.
ESVR_HD inline SampleRange samplesOfLevel(const SampleRange& r, LevelFrame frame) {
  return {std::ceil(r.first / frame.side()), std::floor(r.last / frame.side())};
}

/// The samples of a level. The sample at which the next level begins belongs to both, so that the
/// segment before it is drawn in this one.
/// \param wanted  samples of level 0
ESVR_HD inline SampleRange rangeOf(const LevelScene& s, int place, const SampleRange& wanted) {
  const LevelFrame frame = s.frame(place);
  SampleRange own = wanted;
  if (place > 0) own.first = s.bounds.begin[frame.level] + frame.side();
  if (place < s.last()) own.last = s.bounds.begin[frame.level + 1];
  return samplesOfLevel(own.both(wanted), frame);
}

/// The index of a sample of level 0 in a level (SampleNumber::index).
ESVR_HD inline std::uint32_t indexOf(const MarchScene& scene, const Ray& ray, LevelFrame frame,
                                     double sample) {
  const double inLevel = sample / frame.side() - samplesInScene(scene, ray).first;
  return std::uint32_t((std::int64_t(inLevel) + 1) * kSegmentParts);
}

/// Prepares a ray for the next level.
ESVR_HD inline void passOn(const LevelScene& s, int column, int row, RayProgress& at) {
  const MarchScene from = s.at(at.level), to = s.at(at.level + 1);
  const LevelFrame before = s.frame(at.level), behind = s.frame(at.level + 1);
  const double shared = s.bounds.begin[behind.level];
  from.rule.passOn(at.ray, indexOf(from, from.view.ray(column, row), before, shared),
                   indexOf(to, to.view.ray(column, row), behind, shared),
                   Shades{at.shade, at.shade});
  at.parts = {2.0f * at.parts.change};  // steps become twice as long
  ++at.level;
  at.next = 0;
}

/// Marches through one level.
template <MarchCode kCode, class Slots, class Visitor>
ESVR_HD inline bool marchLevel(const LevelScene& s, int place, const Slots& slots, int column,
                               int row, const SampleRange& wanted, RayProgress& at,
                               Visitor& visitor) {
  MarchScene scene = s.at(place);
  if constexpr (kCode.isUsual) {
    scene.rule.mode = RenderMode::kComposite;
    scene.rule.classification = Classification::kPreIntegrated;
  }
  const MarchSamples samples = samplesOf(scene, column, row, rangeOf(s, place, wanted));
  const BrickTableView& table = s.levels[place].table;
  if constexpr (kCode.isShaded) {
    const Vec3 direction = scene.view.ray(column, row).direction;
    const LitSamples lit{scene.light, floatPlace(scene.view.inCameraSpace(direction))};
    return marchBricks(table, slots, scene, samples, at, visitor, lit);
  } else {
    return marchBricks(table, slots, scene, samples, at, visitor);
  }
}

}  // namespace level_march

/// The color of a ray that has ended.
[[nodiscard]] ESVR_HD inline PixelColor finished(const LevelScene& s, const RayProgress& at) {
  return s.at(at.level).rule.finished(at.ray, Shades{at.shade, at.shade});
}

/// Adds samples to a ray until it ends or meets a brick that is missing; see marchBricks().
/// \tparam kCode   what is known about the scene when the code is compiled
/// \param wanted  range of samples, as numbers of level 0
template <MarchCode kCode, class Slots, class Visitor>
ESVR_HD inline bool marchLevels(const LevelScene& s, const Slots& slots, int column, int row,
                                const SampleRange& wanted, RayProgress& at, Visitor& visitor) {
  using namespace level_march;
  if constexpr (kCode.hasOneLevel) {
    return marchLevel<kCode>(s, 0, slots, column, row, wanted, at, visitor);
  } else {
    for (;; passOn(s, column, row, at)) {
      if (!marchLevel<kCode>(s, at.level, slots, column, row, wanted, at, visitor)) return false;
      if (at.level == s.last() || !s.scene.rule.open(at.ray)) return true;
    }
  }
}

}  // namespace esvr
