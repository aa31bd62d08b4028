#include <algorithm>
#include <array>
#include <bit>
#include <set>

#include "codec/brick_order.h"
#include "codec/cell_tree.h"
#include "codec/frame_coder.h"
#include "core/axes.h"
#include "esvr/error.h"

namespace esvr::codec {
namespace {

constexpr std::size_t kCounts = 11;  // widths of a number of voxels up to 512
constexpr std::size_t kFaces = 8;    // widths of a number of voxels up to 64

bool isInside(Coord brick) {
  constexpr std::int32_t kEnd = 1 << kFrameBrickBits;
  const auto inside = [](std::int32_t place) { return place >= 0 && place < kEnd; };
  return inside(brick.x) && inside(brick.y) && inside(brick.z);
}

/// The active voxels of a brick's face. \param upper  the face with the largest coordinates
int activeOnFace(const BrickMask& mask, std::size_t axis, bool upper) {
  int count = 0;
  for (int v = 0; v < kBrickVoxels; ++v)
    count += voxelLocal(v).*kAxes[axis] == (upper ? kBrickSide - 1 : 0) && mask.test(v);
  return count;
}

template <class Side>
class BrickCoder {
 public:
  BrickCoder(Side& side, const PastVoxels& past, std::vector<Coord> bricks)
      : side_(side), past_(past), bricks_(std::move(bricks)) {}

  std::vector<Coord> code(std::uint64_t maxNew) {
    codeOld();
    codeNeighbours();
    codeRest(maxNew);
    std::sort(coded_.begin(), coded_.end());
    if (std::adjacent_find(coded_.begin(), coded_.end()) != coded_.end())
      throw BadInput("a brick of voxels is there twice");
    return std::move(coded_);
  }

 private:
  /// Codes whether a brick exists.
  void codeBrick(BitModel& model, Coord brick) {
    if (side_.bit(model, std::binary_search(bricks_.begin(), bricks_.end(), brick)))
      coded_.push_back(brick);
  }

  void codeOld() {
    for (std::size_t b = 0; b < past_.layer().bricks.size(); ++b) {
      const Coord brick = past_.brickAt(b);
      const auto width = std::size_t(std::bit_width(unsigned(past_.layer().active[b].count())));
      if (isInside(brick)) codeBrick(kept_[width], brick);
    }
  }

  void codeNeighbours() {
    std::set<Coord> neighbours;
    for (std::size_t b = 0; b < past_.layer().bricks.size(); ++b)
      for (const auto axis : kAxes)
        for (const int step : {-1, 1}) {
          Coord brick = past_.brickAt(b);
          brick.*axis += step;
          if (isInside(brick) && past_.find(brick) == BrickIndex::kNone) neighbours.insert(brick);
        }
    for (const Coord brick : neighbours) codeBrick(added_[facesOf(brick)], brick);
    neighbours_ = std::move(neighbours);
  }

  /// The width of the largest number of active voxels of the previous frame on a face that a brick
  /// touches.
  [[nodiscard]] std::size_t facesOf(Coord brick) const {
    int most = 0;
    for (std::size_t a = 0; a < 3; ++a)
      for (const int step : {-1, 1}) {
        Coord other = brick;
        other.*kAxes[a] += step;
        const std::uint32_t b = past_.find(other);
        if (b != BrickIndex::kNone)
          most = std::max(most, activeOnFace(past_.layer().active[b], a, step < 0));
      }
    return std::size_t(std::bit_width(unsigned(most)));
  }

  /// Codes the bricks that neither are in the previous frame nor touch one of its bricks.
  void codeRest(std::uint64_t maxNew) {
    std::vector<std::uint64_t> keys;
    for (const Coord brick : bricks_)
      if (past_.find(brick) == BrickIndex::kNone && !neighbours_.contains(brick))
        keys.push_back(keyOf(brick));
    std::sort(keys.begin(), keys.end());
    const std::uint64_t count = count_.code(side_, std::uint64_t(keys.size()));
    if (count > maxNew) throw BadInput("more bricks of voxels than its bytes can hold");
    keys.resize(count);
    CellTree<Side>(side_).code(keys, 3 * kFrameBrickBits);
    for (const std::uint64_t key : keys) coded_.push_back(brickAt(key));
  }

  Side& side_;
  const PastVoxels& past_;
  std::vector<Coord> bricks_, coded_;
  std::set<Coord> neighbours_;
  std::array<BitModel, kCounts> kept_;
  std::array<BitModel, kFaces> added_;
  NumberModelOf<6> count_;
};

}  // namespace

void codeFrameBricks(Writer& side, const PastVoxels& past, std::vector<Coord>& bricks) {
  bricks = BrickCoder<Writer>(side, past, bricks).code(bricks.size());
}

void codeFrameBricks(Reader& side, const PastVoxels& past, std::uint64_t maxNew,
                     std::vector<Coord>& bricks) {
  bricks = BrickCoder<Reader>(side, past, {}).code(maxNew);
}

}  // namespace esvr::codec
