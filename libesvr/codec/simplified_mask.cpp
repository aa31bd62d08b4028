// A mask of active voxels that takes fewer bytes than that of a volume and is nearly the same. The bits of a mask are
// estimated with the contexts of the voxel coder and the state in an expected mask. Each change of a block of
// voxels has a price by how much its values matter, and is made if it saves more bits. The price falls until hardly
// more of the overlap may be given up.

#include "esvr/quantised.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>

#include "core/brick_index.h"
#include "core/geometry.h"
#include "core/parallel.h"

namespace esvr {
namespace {

// docs/lab-notes.md, "Simplified masks", compares other moves and schedules.
/// Sides of the blocks that are changed together, in the order of the moves.
constexpr std::array kBlockSides{8, 4, 2, 1};
/// Bits that a changed voxel must save in the first pass, the factor of this price from one pass to
/// the next, and the price at which it ends. After a pass that gave up too much, the price is
/// reduced by smaller factors from that of the last good pass.
constexpr double kFirstPrice = 4.0, kPriceFactor = 0.5, kLeastPrice = 0.03;
constexpr int kMaxFailures = 4;

/// Voxels that differ from the background by more than this many errors are not changed.
constexpr double kMaxFaint = 4.0;
/// Difference of a sum of ellipsoids from the background at an inactive voxel, as a share of the
/// difference of a voxel beside it.
constexpr double kBlur = 0.5;

constexpr double kLeastError = std::numeric_limits<float>::denorm_min();
constexpr double kNoPrice = std::numeric_limits<double>::infinity();
constexpr int kBrickColors = 8;

// ---- The bits that a mask takes

/// A brick with one layer of the voxels around it.
class MaskCube {
 public:
  static constexpr int kSide = kBrickSide + 2;
  static constexpr int kCells = kSide * kSide * kSide;
  static constexpr int kBricks = 27;  ///< the brick itself and those around it

  /// The step to one of these bricks, from -1 to 1 along each axis.
  [[nodiscard]] static Coord step(int brick) {
    return {brick / 9 - 1, brick / 3 % 3 - 1, brick % 3 - 1};
  }

  /// The masks of a brick; null: there is none.
  struct Masks {
    const BrickMask* own = nullptr;
    const BrickMask* expected = nullptr;  ///< a guess of it that a decoder has too
  };

  /// \param find  find(step) returns the Masks of the brick at a step
  template <class Find>
  void fill(const Find& find) {
    for (int n = 0; n < kBricks; ++n) fillPart(step(n), find(step(n)));
  }

  /// Place of a voxel, whose coordinates are from -1 to kBrickSide.
  [[nodiscard]] static std::size_t at(int x, int y, int z) {
    return std::size_t(((x + 1) * kSide + y + 1) * kSide + z + 1);
  }

  [[nodiscard]] bool active(std::size_t at) const { return active_[at] != 0; }
  void set(std::size_t at, bool active) { active_[at] = active; }
  /// False if no brick has the voxel, which takes no bits then.
  [[nodiscard]] bool isCoded(std::size_t at) const { return coded_[at] != 0; }

  /// The context of a voxel with coordinates from 0 to kBrickSide.
  [[nodiscard]] std::size_t context(std::size_t at) const {
    std::size_t bits = expected_[at];
    for (const std::size_t back : kBack) bits = bits << 1 | active_[at - back];
    return bits;
  }

 private:
  static constexpr std::size_t kX = std::size_t(kSide) * kSide, kY = kSide;
  /// The voxels before a voxel, in the order of Halo::activityAround() (codec/voxel_coder.h).
  static constexpr std::array kBack{kX, kY, std::size_t{1}, kX + kY, kX + 1, kY + 1, kX + kY + 1};

  /// The coordinates of the voxels of a cube that lie in the brick at a step.
  struct Interval {
    int first, last;
  };
  static Interval within(int step) {
    if (step < 0) return {-1, -1};
    return step > 0 ? Interval{kBrickSide, kBrickSide} : Interval{0, kBrickSide - 1};
  }

  void fillPart(Coord step, const Masks& masks) {
    const auto in = [](const BrickMask* mask, Coord voxel) {
      return mask && mask->test(voxelOffset(localOf(voxel)));
    };
    const Interval xs = within(step.x), ys = within(step.y), zs = within(step.z);
    for (int x = xs.first; x <= xs.last; ++x)
      for (int y = ys.first; y <= ys.last; ++y)
        for (int z = zs.first; z <= zs.last; ++z) {
          active_[at(x, y, z)] = in(masks.own, {x, y, z});
          expected_[at(x, y, z)] = in(masks.expected, {x, y, z});
          coded_[at(x, y, z)] = masks.own != nullptr;
        }
  }

  std::array<std::uint8_t, kCells> active_{}, coded_{}, expected_{};
};

/// The bits of a voxel by its context and its state.
struct MaskCosts {
  static constexpr std::size_t kContexts = 256;

  std::array<std::array<float, 2>, kContexts> bits{};

  [[nodiscard]] float of(const MaskCube& cube, std::size_t at) const {
    return cube.isCoded(at) ? bits[cube.context(at)][cube.active(at)] : 0.0f;
  }
};

/// Counts of the contexts and states of the voxels of bricks.
class MaskCounts {
 public:
  void add(const MaskCube& cube) {
    for (int x = 0; x < kBrickSide; ++x)
      for (int y = 0; y < kBrickSide; ++y)
        for (int z = 0; z < kBrickSide; ++z) {
          const std::size_t at = MaskCube::at(x, y, z);
          ++counts_[cube.context(at)][cube.active(at)];
        }
  }

  /// Adds a brick whose voxels are, like those around it, all in one state.
  /// \param expected  the state of all of its voxels in the expected mask
  void addUniform(bool active, bool expected) {
    constexpr std::size_t kStates = MaskCosts::kContexts / 2;
    counts_[(expected ? kStates : 0) + (active ? kStates - 1 : 0)][active] += kBrickVoxels;
  }

  void add(const MaskCounts& other) {
    for (std::size_t c = 0; c < counts_.size(); ++c)
      for (std::size_t state = 0; state < 2; ++state) counts_[c][state] += other.counts_[c][state];
  }

  [[nodiscard]] MaskCosts costs() const {
    MaskCosts costs;
    for (std::size_t c = 0; c < counts_.size(); ++c) {
      const double all = double(counts_[c][0] + counts_[c][1]) + 2.0 * kPrior;
      for (std::size_t state = 0; state < 2; ++state)
        costs.bits[c][state] = float(-std::log2((double(counts_[c][state]) + kPrior) / all));
    }
    return costs;
  }

 private:
  /// What is added to each count, so that nothing is impossible (the estimator of Krichevsky and
  /// Trofimov).
  static constexpr double kPrior = 0.5;

  std::array<std::array<std::uint64_t, 2>, MaskCosts::kContexts> counts_{};
};

// ---- What a change costs, and what it saves

/// The values of a volume as prices of changes of its mask.
class Prices {
 public:
  Prices(const SparseVolume& volume, const BrickIndex& index, double error)
      : volume_(volume), index_(index), error_(error), box_(activeBox(volume)) {
    for (std::size_t b = 0; b < volume.brickCount(); ++b)
      for (int v = 0; v < kBrickVoxels; ++v)
        if (volume.active[b].test(v)) addActive(b, v);
  }

  /// The price of giving a voxel another state than it has in the volume.
  [[nodiscard]] double of(std::size_t b, int v) const {
    const bool active = volume_.active[b].test(v);
    if (!active && !box_.contains(volume_.brickCorner(b) + voxelLocal(v))) return kNoPrice;
    if (active && keepsBox(b, v)) return kNoPrice;
    const double faint = (active ? difference(b, v) : kBlur * aroundOf(b, v)) / error_;
    return faint > kMaxFaint ? kNoPrice : 1.0 + faint;
  }

 private:
  struct Place {
    std::size_t brick = 0;
    int offset = -1;  ///< below 0: none
    friend bool operator==(const Place&, const Place&) = default;
  };

  /// Takes account of an active voxel. The first one on each face of the box keeps the box.
  void addActive(std::size_t b, int v) {
    const Coord at = volume_.brickCorner(b) + voxelLocal(v);
    for (std::size_t a = 0; a < std::size(kAxes); ++a) {
      if (at.*kAxes[a] == box_.min.*kAxes[a] && low_[a].offset < 0) low_[a] = {b, v};
      if (at.*kAxes[a] == box_.max.*kAxes[a] && high_[a].offset < 0) high_[a] = {b, v};
    }
  }

  [[nodiscard]] bool keepsBox(std::size_t b, int v) const {
    const Place place{b, v};
    return std::ranges::count(low_, place) + std::ranges::count(high_, place) > 0;
  }

  [[nodiscard]] double difference(std::size_t b, int v) const {
    return std::abs(double(volume_.brickValues(b)[std::size_t(v)]) - volume_.background);
  }

  /// The largest difference of the active voxels beside a voxel.
  [[nodiscard]] double aroundOf(std::size_t b, int v) const {
    constexpr std::array kSteps{Coord{-1, 0, 0}, Coord{1, 0, 0},  Coord{0, -1, 0},
                                Coord{0, 1, 0},  Coord{0, 0, -1}, Coord{0, 0, 1}};
    double largest = 0.0;
    for (const Coord step : kSteps)
      largest = std::max(largest, differenceIfActive(b, voxelLocal(v) + step));
    return largest;
  }

  /// The difference of an active voxel, and 0 for other voxels.
  /// \param local  coordinates in brick b; they may lie in a brick beside it
  [[nodiscard]] double differenceIfActive(std::size_t b, Coord local) const {
    const Coord step = brickOf(local);
    const std::uint32_t at =
        step == Coord{} ? std::uint32_t(b) : index_.find(volume_.bricks[b] + step);
    const int v = voxelOffset(localOf(local));
    return at != BrickIndex::kNone && volume_.active[at].test(v) ? difference(at, v) : 0.0;
  }

  const SparseVolume& volume_;
  const BrickIndex& index_;
  double error_;
  Box box_;
  std::array<Place, 3> low_, high_;  ///< active voxels on the faces of the box, by axis
};

/// Some voxels of a brick.
struct MaskBlock {
  Coord low;  ///< coordinates in the brick
  int side;

  /// Calls visit(x, y, z), also for voxels that are up to `further` voxels above the block.
  template <class Visit>
  void forEach(int further, const Visit& visit) const {
    for (int x = low.x; x < low.x + side + further; ++x)
      for (int y = low.y; y < low.y + side + further; ++y)
        for (int z = low.z; z < low.z + side + further; ++z) visit(x, y, z);
  }
};

/// Changes the mask of one brick.
class BrickMoves {
 public:
  /// \param price  bits for each change, besides the voxel's own price
  BrickMoves(const SparseVolume& volume, const Prices& prices, const MaskCosts& costs, double price,
             std::size_t b)
      : source_(volume.active[b]), prices_(prices), costs_(costs), price_(price), b_(b) {}

  void run(int side, MaskCube& cube) const {
    for (int x = 0; x < kBrickSide; x += side)
      for (int y = 0; y < kBrickSide; y += side)
        for (int z = 0; z < kBrickSide; z += side) tryBlock({{x, y, z}, side}, cube);
  }

 private:
  void tryBlock(const MaskBlock& block, MaskCube& cube) const {
    if (isInside(block, cube)) return;
    std::array<bool, kBrickVoxels> before;
    std::size_t n = 0;
    block.forEach(0,
                  [&](int x, int y, int z) { before[n++] = cube.active(MaskCube::at(x, y, z)); });
    double least = costOf(block, cube);
    std::optional<bool> best;
    for (const bool state : {false, true}) {
      block.forEach(0, [&](int x, int y, int z) { cube.set(MaskCube::at(x, y, z), state); });
      const double cost = costOf(block, cube);
      if (cost < least) least = cost, best = state;
    }
    n = 0;
    block.forEach(0, [&](int x, int y, int z) {
      cube.set(MaskCube::at(x, y, z), best.value_or(before[n]));
      ++n;
    });
  }

  /// True if a change of the block can hardly save bits: all of its voxels are in one state, and in
  /// a block of one voxel also those beside it.
  [[nodiscard]] static bool isInside(const MaskBlock& block, const MaskCube& cube) {
    const auto [x, y, z] = block.low;
    const bool state = cube.active(MaskCube::at(x, y, z));
    bool uniform = true;
    const auto look = [&](int i, int j, int k) {
      uniform &= cube.active(MaskCube::at(i, j, k)) == state;
    };
    if (block.side > 1) {
      block.forEach(0, look);
    } else {
      for (const int d : {-1, 1}) look(x + d, y, z), look(x, y + d, z), look(x, y, z + d);
    }
    return uniform;
  }

  /// The bits of the voxels of a block and of those whose contexts it is in, and the prices of its
  /// changes.
  [[nodiscard]] double costOf(const MaskBlock& block, const MaskCube& cube) const {
    double cost = 0.0;
    block.forEach(1, [&](int x, int y, int z) { cost += costs_.of(cube, MaskCube::at(x, y, z)); });
    block.forEach(0, [&](int x, int y, int z) {
      const int v = voxelOffset({x, y, z});
      if (cube.active(MaskCube::at(x, y, z)) != source_.test(v)) cost += price_ * prices_.of(b_, v);
    });
    return cost;
  }

  const BrickMask& source_;
  const Prices& prices_;
  const MaskCosts& costs_;
  double price_;
  std::size_t b_;
};

class MaskSimplifier {
 public:
  MaskSimplifier(const SparseVolume& volume, double error, std::span<const BrickMask> expected)
      : volume_(volume),
        expected_(expected),
        index_(volume.bricks),
        prices_(volume, index_, error),
        masks_(volume.active) {
    for (std::size_t b = 0; b < volume.brickCount(); ++b) {
      const Coord brick = volume.bricks[b];
      byColor_[std::size_t((brick.x & 1) << 2 | (brick.y & 1) << 1 | (brick.z & 1))].push_back(b);
    }
  }

  MaskSimplifier(const MaskSimplifier&) = delete;
  MaskSimplifier& operator=(const MaskSimplifier&) = delete;

  std::vector<BrickMask> run() {
    double price = kFirstPrice, factor = kPriceFactor, good = kFirstPrice / kPriceFactor;
    for (int failures = 0; failures < kMaxFailures && price > kLeastPrice;) {
      auto before = masks_;
      for (const int side : kBlockSides) move(price, side);
      if (overlapOf(volume_.active, masks_).suffices()) {
        good = price;
      } else {
        masks_ = std::move(before);
        factor = std::sqrt(factor);
        ++failures;
      }
      price = good * factor;
    }
    return std::move(masks_);
  }

 private:
  /// Bricks of one color do not touch each other, so that they can be changed at the same time.
  void move(double price, int side) {
    const MaskCosts costs = count().costs();
    for (const auto& bricks : byColor_)
      parallelFor(std::size_t{0}, bricks.size(), [&](std::size_t n) {
        const std::size_t b = bricks[n];
        if (isUniform(b)) return;
        MaskCube cube = cubeOf(b);
        BrickMoves(volume_, prices_, costs, price, b).run(side, cube);
        masks_[b] = maskOf(cube);
      });
  }

  [[nodiscard]] MaskCounts count() const {
    using MaskRange = tbb::blocked_range<std::size_t>;
    return parallelReduce(
        MaskRange(0, masks_.size()), MaskCounts(),
        [&](const MaskRange& bricks, MaskCounts counts) {
          for (std::size_t b = bricks.begin(); b != bricks.end(); ++b)
            if (isUniform(b))
              counts.addUniform(masks_[b].test(0), !expected_.empty() && expected_[b].test(0));
            else
              counts.add(cubeOf(b));
          return counts;
        },
        [](MaskCounts a, const MaskCounts& b) {
          a.add(b);
          return a;
        });
  }

  /// The masks of the brick at a step from brick b.
  [[nodiscard]] MaskCube::Masks masksBeside(std::size_t b, Coord step) const {
    const std::uint32_t at = index_.find(volume_.bricks[b] + step);
    if (at == BrickIndex::kNone) return {};
    return {&masks_[at], expected_.empty() ? nullptr : &expected_[at]};
  }

  /// True if all voxels of a brick and of the bricks around it are in the same state, and those of
  /// the brick in one state in the expected mask.
  [[nodiscard]] bool isUniform(std::size_t b) const {
    BrickMask uniform;
    if (masks_[b].test(0)) uniform.setAll();
    if (masks_[b] != uniform) return false;
    if (!expected_.empty() && !isUniform(expected_[b])) return false;
    for (int n = 0; n < MaskCube::kBricks; ++n) {
      const BrickMask* mask = masksBeside(b, MaskCube::step(n)).own;
      if ((mask ? *mask : BrickMask{}) != uniform) return false;
    }
    return true;
  }

  [[nodiscard]] static bool isUniform(const BrickMask& mask) {
    BrickMask full;
    full.setAll();
    return mask == full || mask == BrickMask{};
  }

  [[nodiscard]] MaskCube cubeOf(std::size_t b) const {
    MaskCube cube;
    cube.fill([&](Coord step) { return masksBeside(b, step); });
    return cube;
  }

  static BrickMask maskOf(const MaskCube& cube) {
    BrickMask mask;
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord at = voxelLocal(v);
      if (cube.active(MaskCube::at(at.x, at.y, at.z))) mask.set(v);
    }
    return mask;
  }

  const SparseVolume& volume_;
  std::span<const BrickMask> expected_;  ///< masks of the bricks; empty if nothing is expected
  BrickIndex index_;
  Prices prices_;
  std::vector<BrickMask> masks_;
  std::array<std::vector<std::size_t>, kBrickColors> byColor_;
};

}  // namespace

MaskOverlap overlapOf(std::span<const BrickMask> a, std::span<const BrickMask> b) {
  MaskOverlap overlap;
  for (std::size_t n = 0; n < a.size(); ++n)
    for (std::size_t w = 0; w < a[n].words.size(); ++w) {
      overlap.both += std::uint64_t(std::popcount(a[n].words[w] & b[n].words[w]));
      overlap.either += std::uint64_t(std::popcount(a[n].words[w] | b[n].words[w]));
    }
  return overlap;
}

std::vector<BrickMask> simplifiedMask(const SparseVolume& volume, double error,
                                      std::span<const BrickMask> expected) {
  return MaskSimplifier(volume, error, expected).run();
}

std::span<const BrickMask> SimplifiedMasks::forError(double error) const {
  const int exponent = int(std::lround(std::log2(std::max(error_.value_or(error), kLeastError))));
  const std::lock_guard lock(making_);
  auto& masks = byExponent_[exponent];
  if (!expected_) expected_ = makeExpected_ ? makeExpected_() : std::vector<BrickMask>{};
  if (masks.empty() &&
      volume_.brickCount() > 0)  // the loops must not take up a task that waits here
    tbb::this_task_arena::isolate(
        [&] { masks = simplifiedMask(volume_, std::ldexp(1.0, exponent), *expected_); });
  return masks;
}

}  // namespace esvr
