#pragma once
/// Divides the lines along y on which an ellipsoid meets a brick among the lanes of a group.

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

/// The voxels of one line that lie in the support: yBegin to yEnd - 1.
struct PairLine {
  int offset;  ///< padded offset of the voxel y = 0
  int yBegin, yEnd;
  float dx, dz;   ///< position relative to the ellipsoid's center
  float closest;  ///< m at the point of the line that is closest to the center
  float t;        ///< distance from that point to yBegin
};

struct Interval {
  int begin, end;
};

/// The voxels of 0 to 7 that lie in [middle - half, middle + half]. The interval is widened by a
/// hundredth of a voxel because of rounding.
__device__ inline Interval voxelsWithin(float middle, float half) {
  constexpr float kPad = 0.01f;
  const int begin = int(fmaxf(ceilf(middle - half - kPad), 0.0f));
  const int end = int(fminf(floorf(middle + half + kPad), float(kBrickSide - 1))) + 1;
  return {begin, end};
}

/// Calls visit(line) for the lines that lane `lane` of a group works on.
template <class Visit>
__device__ inline void visitLines(const PairForm& p, Coord corner, float cutoff, int lane,
                                  Visit&& visit) {
  const LineForm& f = p.form;
  const Coord local = corner - p.frame;
  const float cx = f.center[0] - float(local.x), cy = f.center[1] - float(local.y),
              cz = f.center[2] - float(local.z);
  const Interval xs = voxelsWithin(cx, f.halfX), zs = voxelsWithin(cz, p.halfZ);
  const int depth = zs.end - zs.begin;
  const int count = max(xs.end - xs.begin, 0) * max(depth, 0);
  const float inverse = 1.0f / float(depth);  // precise enough for n < 64
  for (int n = lane; n < count; n += kGroup) {
    const int row = int((float(n) + 0.5f) * inverse);
    const int x = xs.begin + row, z = zs.begin + n - row * depth;
    const float dx = float(x) - cx, dz = float(z) - cz;
    const float pzDz[3] = {f.pz[0] * dz, f.pz[1] * dz, f.pz[2] * dz};
    const float closest = closestSquared(f, dx, pzDz);
    if (!(closest < cutoff)) continue;
    const float middle = -distanceAlong(f, 0.0f, cy, dx, dz);
    const Interval ys = voxelsWithin(middle, sqrtf((cutoff - closest) / f.a));
    visit(PairLine{paddedOffset(x, 0, z), ys.begin, ys.end, dx, dz, closest,
                   float(ys.begin) - middle});
  }
}

/// phi with the fast exponential of the device. It differs from kernelPhi by about 1e-6 at most.
__device__ inline float fastPhi(const KernelConstants<float>& k, float m) {
  if (!(m < k.cutoff)) return 0.0f;
  return __fdividef(k.numerator, k.plateau + __expf(m - k.shift)) - k.base;
}

}  // namespace esvr::cuda
