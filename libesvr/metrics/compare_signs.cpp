#include "esvr/empty_signs.h"
#include "esvr/sign_errors.h"
#include "metrics/brick_pairs.h"

namespace esvr {
namespace {

/// The signs of one volume: of a brick's voxels, or of the empty space.
struct Signs {
  const float* values;  ///< null: no brick
  bool emptyIsInside;

  [[nodiscard]] bool isInside(int v) const { return values ? values[v] < 0.0f : emptyIsInside; }
};

Signs signsAt(const float* values, const EmptySigns& empty, Coord brick) {
  return {values, !values && empty.isInside(brick)};
}

}  // namespace

SignErrors compareSigns(const SparseVolume& reference, const SparseVolume& candidate) {
  const EmptySigns emptyReference(reference), emptyCandidate(candidate);
  SignErrors errors;
  for (const metrics::BrickPair& pair : metrics::pairBricks(reference, candidate)) {
    const Signs a = signsAt(pair.reference, emptyReference, pair.brick);
    const Signs b = signsAt(pair.candidate, emptyCandidate, pair.brick);
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (a.isInside(v) == b.isInside(v)) continue;
      if (errors.voxels++ == 0) errors.first = pair.brick * kBrickSide + voxelLocal(v);
    }
  }
  return errors;
}

}  // namespace esvr
