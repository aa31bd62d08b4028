#pragma once
/// Divides the lines along y on which an ellipsoid meets a brick among the lanes of a group. The
/// inner loops of a pass take as many instructions as the code before them, so both are written for
/// few instructions (docs/lab-notes.md, "The fit on a GPU").

#include "esvr/sparse_volume.h"
#include "field/line_math.h"
#include "fit/cuda/pair_form.h"

namespace esvr::cuda {

/// Number of lanes that work on one pair. A support of a few voxels meets a brick on about ten
/// lines.
inline constexpr int kGroup = 8;

/// Distance between the slices (x) of a brick in shared memory. They are padded, so that the voxels
/// of neighbouring lines lie in different memory banks.
inline constexpr int kSliceStride = kBrickSide * kBrickSide + kBrickSide;
inline constexpr int kPaddedVoxels = kSliceStride * kBrickSide;

__device__ inline int paddedOffset(int x, int y, int z) {
  return x * kSliceStride + y * kBrickSide + z;
}
__device__ inline int paddedOffset(int voxel) {
  return voxel + (voxel >> (2 * kBrickLog2)) * kBrickSide;
}

/// The voxels of one line that lie in the support.
struct PairLine {
  int offset;     ///< padded offset of the first voxel
  int count;      ///< number of voxels; 0 or negative if there are none
  float dx, dz;   ///< position relative to the ellipsoid's center
  float closest;  ///< m at the point of the line that is closest to the center
  float t;        ///< distance from that point to the first voxel
};

/// Consecutive voxels of a brick along one axis.
struct Interval {
  float begin;  ///< coordinate of the first voxel
  int first;    ///< the same as an integer
  int count;    ///< number of voxels; 0 or negative if there are none
};

/// The voxels of 0 to 7 that lie in [middle - half, middle + half]. The interval is widened by a
/// hundredth of a voxel because of rounding.
__device__ inline Interval voxelsWithin(float middle, float half) {
  constexpr float kPad = 0.01f, kSide = float(kBrickSide);
  // The lowest bits of a float near 1.5 * 2^23 are those of an integer. Such additions are faster
  // than conversions.
  constexpr float kWhole = 12582912.0f;
  const float low = __fadd_ru(fminf(fmaxf(middle - half - kPad, 0.0f), kSide), kWhole);
  const float high = __fadd_rd(fminf(fmaxf(middle + half + kPad, -1.0f), kSide - 1.0f), kWhole);
  const int first = __float_as_int(low) - __float_as_int(kWhole);
  return {low - kWhole, first, __float_as_int(high) - __float_as_int(low) + 1};
}

/// The (x, z) of the lines that one lane works on. Lines are numbered along z first.
class LinePlaces {
 public:
  /// \param cx, cz  the ellipsoid's center relative to the brick
  __device__ LinePlaces(const Interval& xs, const Interval& zs, float cx, float cz, int lane)
      : depth_(float(zs.count)), endDz_(zs.begin - cz + depth_) {
    const float perDepth = __fdividef(1.0f, depth_);
    const int row = rows(lane, perDepth), step = rows(kGroup, perDepth);
    const int column = lane - row * zs.count;
    stepX_ = float(step), stepZ_ = float(kGroup - step * zs.count);
    stepOffset_ = paddedOffset(step, 0, kGroup - step * zs.count);
    wrapOffset_ = paddedOffset(1, 0, -zs.count);
    dx = xs.begin - cx + float(row), dz = zs.begin - cz + float(column);
    offset = paddedOffset(xs.first + row, 0, zs.first + column);
  }

  /// Moves by kGroup lines.
  __device__ void advance() {
    dx += stepX_, dz += stepZ_, offset += stepOffset_;
    if (dz < endDz_ - 0.5f) return;
    dx += 1.0f, dz -= depth_, offset += wrapOffset_;
  }

  float dx, dz;  ///< position relative to the ellipsoid's center
  int offset;    ///< padded offset of the voxel y = 0

 private:
  /// The rows that the first n lines fill, for n < 64.
  __device__ static int rows(int n, float perDepth) { return int((float(n) + 0.5f) * perDepth); }

  float depth_, endDz_, stepX_, stepZ_;
  int stepOffset_, wrapOffset_;
};

/// Calls visit(line) for the lines that lane `lane` of a group works on.
template <class Visit>
__device__ inline void visitLines(const PairForm& p, Coord corner, float cutoff, int lane,
                                  Visit&& visit) {
  const LineForm& f = p.form;
  const Coord local = corner - p.frame;
  const float cx = f.center[0] - float(local.x), cy = f.center[1] - float(local.y),
              cz = f.center[2] - float(local.z);
  const Interval xs = voxelsWithin(cx, f.halfX), zs = voxelsWithin(cz, p.halfZ);
  if (xs.count <= 0 || zs.count <= 0) return;
  LinePlaces place(xs, zs, cx, cz, lane);
  const float inverseA = __fdividef(1.0f, f.a);
  for (int n = xs.count * zs.count - lane; n > 0; n -= kGroup, place.advance()) {
    const float pzDz[3] = {f.pz[0] * place.dz, f.pz[1] * place.dz, f.pz[2] * place.dz};
    const float closest = closestSquared(f, place.dx, pzDz);
    if (!(closest < cutoff)) continue;
    const float middle = -distanceAlong(f, 0.0f, cy, place.dx, place.dz);
    const Interval ys = voxelsWithin(middle, sqrtf((cutoff - closest) * inverseA));
    visit(PairLine{place.offset + ys.first * kBrickSide, ys.count, place.dx, place.dz, closest,
                   ys.begin - middle});
  }
}

}  // namespace esvr::cuda
