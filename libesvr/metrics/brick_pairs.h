#pragma once
/// Pairs of the bricks of two volumes, over which all metrics of volumes iterate.

#include <cstdint>
#include <span>
#include <vector>

#include "esvr/volume.h"

namespace esvr::metrics {

/// A position at which at least one of two volumes has a brick. Voxels are given by voxelOffset.
struct BrickPair {
  Coord brick;                       ///< brick coordinates in index space: corner / 8
  const float* reference = nullptr;  ///< null where only the candidate has a brick here
  const float* candidate = nullptr;  ///< null where only the reference has one
  const BrickMask* referenceActive = nullptr;
  const BrickMask* candidateActive = nullptr;
  /// The values of the volumes where they have no brick: the background or, inside the surface of a
  /// narrow band, the negated background.
  float referenceEmpty = 0.0f, candidateEmpty = 0.0f;

  [[nodiscard]] double referenceAt(int v) const {
    return reference ? reference[v] : referenceEmpty;
  }
  [[nodiscard]] double candidateAt(int v) const {
    return candidate ? candidate[v] : candidateEmpty;
  }
  [[nodiscard]] double errorAt(int v) const { return referenceAt(v) - candidateAt(v); }
  [[nodiscard]] bool isReferenceActive(int v) const {
    return referenceActive && referenceActive->test(v);
  }
  [[nodiscard]] bool isAnyActive(int v) const {
    return isReferenceActive(v) || (candidateActive && candidateActive->test(v));
  }
  /// The index coordinates of a voxel.
  [[nodiscard]] Coord voxelAt(int v) const { return brick * kBrickSide + voxelLocal(v); }
};

/// The union of both volumes' bricks in increasing order of Coord. The pairs point into the
/// volumes.
[[nodiscard]] std::vector<BrickPair> pairBricks(const SparseVolume& reference,
                                                const SparseVolume& candidate);

/// The values of the two volumes at places that no pair covers.
struct Backgrounds {
  double reference = 0.0, candidate = 0.0;
};

/// The voxels of a brick that lie in a box, in local coordinates; empty if there are none.
[[nodiscard]] Box localBox(Coord brick, const Box& box);

/// The rank-th smallest |error| (from 1) over the union of active voxels. The digits of its bit
/// pattern are determined one after the other by counting. The memory does not depend on the number
/// of voxels, and the counts do not depend on the order of threads.
[[nodiscard]] double errorOfRank(std::span<const BrickPair> pairs, std::uint64_t rank);

/// Rank of a percentile by the nearest-rank definition: the rank of the smallest value that at
/// least `permille` thousandths of `count` values do not exceed.
[[nodiscard]] std::uint64_t nearestRank(std::uint64_t count, std::uint64_t permille);

}  // namespace esvr::metrics
