#pragma once
/// Pairs of the bricks of two volumes, which all metrics iterate over.

#include <vector>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"

namespace esvr::metrics {

/// A position at which at least one of two volumes has a brick.
struct BrickPair {
  Coord brick;                       ///< brick coordinates in index space: corner / 8
  const float* reference = nullptr;  ///< null where only the candidate has a brick here
  const float* candidate = nullptr;  ///< null where only the reference has one
  const BrickMask* referenceActive = nullptr;
  const BrickMask* candidateActive = nullptr;
  /// The values of the volumes where they have no brick: the background or, inside the surface of a
  /// narrow band, the negated background.
  float referenceEmpty = 0.0f, candidateEmpty = 0.0f;
};

/// The union of both volumes' bricks in increasing order of Coord. The pairs point into the
/// volumes.
[[nodiscard]] std::vector<BrickPair> pairBricks(const SparseVolume& reference,
                                                const SparseVolume& candidate);

/// The values of the two volumes at places that no pair covers.
struct Backgrounds {
  double reference = 0.0, candidate = 0.0;
};

/// The voxels of a pair.
class PairValues {
 public:
  explicit PairValues(const BrickPair& pair) : pair_(pair) {}

  [[nodiscard]] double reference(int offset) const {
    return pair_.reference ? pair_.reference[offset] : pair_.referenceEmpty;
  }
  [[nodiscard]] double candidate(int offset) const {
    return pair_.candidate ? pair_.candidate[offset] : pair_.candidateEmpty;
  }
  [[nodiscard]] double error(int offset) const { return reference(offset) - candidate(offset); }
  [[nodiscard]] bool referenceActive(int offset) const {
    return pair_.referenceActive && pair_.referenceActive->test(offset);
  }
  [[nodiscard]] bool candidateActive(int offset) const {
    return pair_.candidateActive && pair_.candidateActive->test(offset);
  }
  [[nodiscard]] Coord voxel(int offset) const {
    return pair_.brick * kBrickSide + voxelLocal(offset);
  }

 private:
  const BrickPair& pair_;
};

/// The voxels of a brick that lie in a box, in local coordinates; empty if there are none.
[[nodiscard]] Box localBox(Coord brick, const Box& box);

}  // namespace esvr::metrics
