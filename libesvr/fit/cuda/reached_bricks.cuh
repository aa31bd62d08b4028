#pragma once
/// Visits the bricks that ellipsoids reach. A warp visits the bricks around one ellipsoid. If these
/// are many, a whole block visits them, because otherwise the few largest ellipsoids would keep
/// single warps busy long after all others have ended.

#include <cstdint>

#include "core/cuda/reduce.cuh"
#include "core/cuda/thread_number.cuh"
#include "fit/cuda/supports.h"

namespace esvr::cuda {

inline constexpr int kWarpsOfBlock = kBlock / kWarp;

/// A lane's place among those of its team that want one.
struct TeamRank {
  std::uint32_t before;  ///< lanes before this one
  std::uint32_t all;
};

/// The lanes of a warp.
struct WarpTeam {
  static constexpr std::uint32_t kSize = kWarp;

  [[nodiscard]] __device__ std::uint32_t lane() const { return threadIdx.x % kWarp; }
  /// To be called on all lanes together.
  [[nodiscard]] __device__ TeamRank rank(bool wanted) const {
    const unsigned those = __ballot_sync(kAllLanes, wanted);
    return {std::uint32_t(__popc(those & ((1u << lane()) - 1u))), std::uint32_t(__popc(those))};
  }
};

/// The threads of a block of kBlock.
struct BlockTeam {
  static constexpr std::uint32_t kSize = kBlock;
  std::uint32_t* counts;  ///< kWarpsOfBlock, shared

  [[nodiscard]] __device__ std::uint32_t lane() const { return threadIdx.x; }
  /// To be called on all lanes together.
  [[nodiscard]] __device__ TeamRank rank(bool wanted) const {
    TeamRank rank = WarpTeam{}.rank(wanted);
    const std::uint32_t warp = threadIdx.x / kWarp;
    if (threadIdx.x % kWarp == 0) counts[warp] = rank.all;
    __syncthreads();
    rank.all = 0;
    for (std::uint32_t w = 0; w < kWarpsOfBlock; ++w) {
      if (w < warp) rank.before += counts[w];
      rank.all += counts[w];
    }
    __syncthreads();  // before the counts are written again
    return rank;
  }
};

/// An ellipsoid whose bricks a team goes through.
template <class Team>
struct ReachedBricks {
  Team team;
  std::size_t ellipsoid;
  Support support;
  Box range;  ///< the bricks to visit; may be empty

  /// Calls visit(brick, reached) on all lanes together until every brick of the range has been
  /// visited by one lane, lanes and rounds in increasing order of the bricks.
  template <class Visit>
  __device__ void visit(Visit&& visit) const {
    if (range.empty()) return;
    const auto ny = std::uint64_t(range.max.y - range.min.y) + 1;
    const auto nz = std::uint64_t(range.max.z - range.min.z) + 1;
    const std::uint64_t count = (std::uint64_t(range.max.x - range.min.x) + 1) * ny * nz;
    const SlabTest mayTouch(support);
    for (std::uint64_t first = 0; first < count; first += Team::kSize) {
      const std::uint64_t n = first + team.lane(), row = n / nz, column = row / ny;
      const Coord brick{range.min.x + std::int32_t(column),
                        range.min.y + std::int32_t(row - column * ny),
                        range.min.z + std::int32_t(n - row * nz)};
      visit(brick, n < count && mayTouch(brick));
    }
  }
};

/// For kernels of blocks of kBlock, with a warp for each ellipsoid: calls walk(ReachedBricks) for
/// every ellipsoid, on all lanes of its team. \param within  bricks elsewhere are passed over
template <class Walk>
__device__ void walkReachedBricks(const SupportSource& source, const Box& within, Walk&& walk) {
  constexpr double kFewBricks = 8 * kWarp;
  __shared__ std::uint32_t counts[kWarpsOfBlock];
  __shared__ bool large[kWarpsOfBlock];
  const auto walkOf = [&](auto team, std::size_t i) {
    const Support support = source.supportOf(i);
    walk(ReachedBricks<decltype(team)>{team, i, support, clippedRange(support, within)});
  };

  const std::size_t own = warpNumber();
  bool few = true;
  if (own < source.count) few = clippedRange(source.supportOf(own), within).volume() <= kFewBricks;
  if (threadIdx.x % kWarp == 0) large[threadIdx.x / kWarp] = !few;
  if (own < source.count && few) walkOf(WarpTeam{}, own);
  __syncthreads();
  for (std::size_t w = 0; w < kWarpsOfBlock; ++w)
    if (large[w]) walkOf(BlockTeam{counts}, std::size_t(blockIdx.x) * kWarpsOfBlock + w);
}

}  // namespace esvr::cuda
