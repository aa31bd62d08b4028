// The voxels of the previous frame on the lattice of the next one, and the search for the motion of a brick.

#include "codec/past_voxels.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "codec/voxel_values.h"
#include "core/parallel.h"

namespace esvr::codec {
namespace {

/// Largest distance of two origins along an axis, in bricks.
constexpr std::int64_t kLargestShift = 1 << 24;

bool sameLattice(const VoxelLayer& a, const VoxelLayer& b) {
  return a.form == b.form && a.divisor == b.divisor && a.palette == b.palette;
}

/// Largest place of a value that a lattice has no code for. A code is at most 2^36 from it.
constexpr double kLargestPlace = 0x1p35;
constexpr double kLargestFloat = std::numeric_limits<float>::max();

double placeOf(const VoxelLayer& now, double value) {
  if (now.form == VoxelForm::kQuantised)
    return std::clamp(value * now.divisor, -kLargestPlace, kLargestPlace);
  return double(codeOfValue(now, float(std::clamp(value, -kLargestFloat, kLargestFloat))));
}

bool isNear(std::int32_t a, std::int32_t b) {
  return std::abs(std::int64_t(a) - b) <= kLargestShift * kBrickSide;
}

Coord shiftOf(const VoxelLayer& past, const VoxelLayer& now) {
  return brickOf(past.origin - now.origin);
}

}  // namespace

bool isPredictable(const VoxelLayer& now, const VoxelLayer& past) {
  if (!isNear(now.origin.x, past.origin.x) || !isNear(now.origin.y, past.origin.y) ||
      !isNear(now.origin.z, past.origin.z))
    return false;
  const std::int32_t vacant = codeOfValue(now, now.background);
  for (std::size_t i = 0; i < now.codes.size(); ++i)
    if (now.codes[i] != vacant && now.vacant[i / kBrickVoxels].test(int(i % kBrickVoxels)))
      return false;
  return true;
}

PastVoxels::PastVoxels(const VoxelLayer& past, const VoxelLayer& now, const ValueMap& map)
    : past_(past),
      index_(past.bricks),
      shift_(shiftOf(past, now)),
      vacantPlace_(double(codeOfValue(now, now.background))),
      places_(past.codes.size(), past.codes.get_allocator()) {
  const bool same = map == ValueMap{} && sameLattice(past, now);
  parallelFor(std::size_t{0}, past.bricks.size(), [&](std::size_t b) {
    for (std::size_t v = 0; v < kBrickVoxels; ++v) {
      const std::size_t i = b * kBrickVoxels + v;
      if (past.vacant[b].test(int(v)))
        places_[i] = vacantPlace_;
      else
        places_[i] =
            same ? double(past.codes[i])
                 : placeOf(now, map.gain * double(valueOfCode(past, past.codes[i])) + map.offset);
    }
  });
}

void PastVoxels::fillLine(Coord voxel, int count, double* place, bool* active) const {
  for (int done = 0; done < count;) {
    const int z = localOf(voxel).z, now = std::min(count - done, kBrickSide - z);
    const std::uint32_t b = find(brickOf(voxel));
    const int first = voxelOffset(localOf(voxel));
    for (int n = 0; n < now; ++n) {
      const bool there = b != BrickIndex::kNone;
      place[done + n] =
          there ? places_[std::size_t(b) * kBrickVoxels + std::size_t(first + n)] : vacantPlace_;
      active[done + n] = there && past_.active[b].test(first + n);
    }
    done += now;
    voxel.z += now;
  }
}

// ---- Motion

namespace {

/// Sum of distances, in codes, that coding another motion than the expected one is worth.
constexpr double kMotionPrice = 12.0;

bool isPossible(Coord motion) {
  return std::max({std::abs(motion.x), std::abs(motion.y), std::abs(motion.z)}) <= kLargestMotion;
}

constexpr Coord kSteps[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};

}  // namespace

Coord MotionSearch::find(Coord brick, std::span<const std::int32_t> codes, Coord expected) {
  past_.fill(brick, {}, *cube_);
  Coord best = expected;
  double least = costOf(best, codes, expected);
  const auto consider = [&](Coord motion) {
    if (!isPossible(motion)) return false;
    const double cost = costOf(motion, codes, expected);
    if (cost >= least) return false;
    least = cost, best = motion;
    return true;
  };
  consider({});
  for (bool better = least > 0.0; better;) {
    better = false;
    const Coord from = best;
    for (const Coord step : kSteps) better = consider(from + step) || better;
  }
  return best;
}

double MotionSearch::costOf(Coord motion, std::span<const std::int32_t> codes,
                            Coord expected) const {
  using Cube = PastCube<kLargestMotion>;
  double sum = motion == expected ? 0.0 : kMotionPrice;
  const std::int32_t* code = codes.data();
  for (int x = 0; x < kBrickSide; ++x)
    for (int y = 0; y < kBrickSide; ++y) {
      const double* place = &cube_->place[Cube::cell(Coord{x, y, 0} - motion)];
      for (int z = 0; z < kBrickSide; ++z) sum += std::abs(double(*code++) - place[z]);
    }
  return sum;
}

}  // namespace esvr::codec
