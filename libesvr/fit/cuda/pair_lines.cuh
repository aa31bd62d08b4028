#pragma once
/// The lines along y on which an ellipsoid meets a brick, shared out among a group of lanes.

#include "esvr/sparse_volume.h"
#include "field/line_math.h"
#include "fit/cuda/pair_form.h"

namespace esvr::cuda {

/// Lanes that work on one pair. Supports of a few voxels meet a brick on some ten lines.
inline constexpr int kGroup = 8;

/// Slices of a brick in shared memory lie so far apart that the voxels of neighbouring lines are in
/// different banks.
inline constexpr int kSliceStride = kBrickSide * kBrickSide + kBrickSide;
inline constexpr int kPaddedVoxels = kSliceStride * kBrickSide;

__device__ inline int paddedOffset(int x, int y, int z) {
  return x * kSliceStride + y * kBrickSide + z;
}
__device__ inline int paddedOffset(int voxel) {
  return voxel + (voxel >> (2 * kBrickLog2)) * kBrickSide;
}

/// One line: voxels yBegin .. yEnd - 1.
struct PairLine {
  int offset;  ///< of voxel y = 0, padded
  int yBegin, yEnd;
  float dx, dz;   ///< from the ellipsoid's center
  float closest;  ///< m at the closest approach
  float t;        ///< how far yBegin lies beyond the closest approach
};

struct Interval {
  int begin, end;
};

/// Voxels of 0..7 within [middle - half, middle + half], a hundredth more against rounding.
__device__ inline Interval voxelsWithin(float middle, float half) {
  constexpr float kPad = 0.01f;
  const int begin = int(fmaxf(ceilf(middle - half - kPad), 0.0f));
  const int end = int(fminf(floorf(middle + half + kPad), float(kBrickSide - 1))) + 1;
  return {begin, end};
}

/// Calls visit(line) for the lines that lane `lane` of a group is to work on.
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
  const float inverse = 1.0f / float(depth);  // exact enough for n < 64
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

/// phi with the device's own exponential, within some 1e-6 of kernelPhi.
__device__ inline float fastPhi(const KernelConstants<float>& k, float m) {
  if (!(m < k.cutoff)) return 0.0f;
  return __fdividef(k.numerator, k.plateau + __expf(m - k.shift)) - k.base;
}

}  // namespace esvr::cuda
