#include <array>
#include <bit>

#include "codec/brick_coder.h"
#include "codec/frame_coder.h"
#include "core/axes.h"

namespace esvr::codec {
namespace {

/// The active voxels of a brick's face. \param upper  the face with the largest coordinates
int activeOnFace(const BrickMask& mask, std::size_t axis, bool upper) {
  int count = 0;
  for (int v = 0; v < kBrickVoxels; ++v)
    count += voxelLocal(v).*kAxes[axis] == (upper ? kBrickSide - 1 : 0) && mask.test(v);
  return count;
}

/// The bricks of the previous frame as context, by the numbers of their active voxels.
class PastBricks {
 public:
  static constexpr std::size_t kKeptContexts = 11;  ///< widths of a number of voxels up to 512
  static constexpr std::size_t kAddedContexts = 8;  ///< widths of a number of voxels up to 64

  explicit PastBricks(const PastVoxels& past) : past_(past) {}

  [[nodiscard]] std::size_t count() const { return past_.layer().bricks.size(); }
  [[nodiscard]] Coord brickAt(std::size_t b) const { return past_.brickAt(b); }
  [[nodiscard]] std::uint32_t find(Coord brick) const { return past_.find(brick); }

  [[nodiscard]] std::size_t keptContext(std::size_t b) const {
    return std::size_t(std::bit_width(unsigned(past_.layer().active[b].count())));
  }

  /// The width of the largest number of active voxels of the previous frame on a face that a brick
  /// touches.
  [[nodiscard]] std::size_t addedContext(Coord brick) const {
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

 private:
  const PastVoxels& past_;
};

}  // namespace

void codeFrameBricks(Writer& side, const PastVoxels& past, std::vector<Coord>& bricks) {
  const PastBricks set(past);
  bricks = BrickCoder<Writer, PastBricks>(side, set, bricks).code(bricks.size());
}

void codeFrameBricks(Reader& side, const PastVoxels& past, std::uint64_t maxNew,
                     std::vector<Coord>& bricks) {
  const PastBricks set(past);
  bricks = BrickCoder<Reader, PastBricks>(side, set, {}).code(maxNew);
}

}  // namespace esvr::codec
