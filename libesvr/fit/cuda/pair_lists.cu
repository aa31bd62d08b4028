#include <array>
#include <bit>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_reduce.cuh>
#include <cub/device/device_scan.cuh>

#include "core/cuda/copy.h"
#include "core/cuda/count32.h"
#include "core/cuda/reduce.cuh"
#include "core/cuda/temporary.h"
#include "fit/cuda/pair_lists.h"
#include "fit/cuda/reached_bricks.cuh"

namespace esvr::cuda {
namespace {

/// Calls visit(brick's number, brick, position among the ellipsoid's pairs) for each pair.
/// \return how many there are, on all lanes
template <class Team, class Visit>
__device__ std::uint32_t visitPairs(const ReachedBricks<Team>& reachedBricks,
                                    const BrickTableView& bricks, Visit&& visit) {
  std::uint32_t before = 0;
  reachedBricks.visit([&](Coord brick, bool reached) {
    const std::uint32_t number = reached ? bricks.find(brick) : kNoBrick;
    const TeamRank rank = reachedBricks.team.rank(number != kNoBrick);
    if (number != kNoBrick) visit(number, brick, before + rank.before);
    before += rank.all;
  });
  return before;
}

__global__ void countPairsKernel(SupportSource source, BrickTableView bricks, std::uint32_t* counts,
                                 std::uint32_t* chunks) {
  walkReachedBricks(source, bricks.bounds, [&](const auto& reached) {
    const std::uint32_t n = visitPairs(reached, bricks, [](std::uint32_t, Coord, std::uint32_t) {});
    if (reached.team.lane() != 0) return;
    counts[reached.ellipsoid] = n;
    // Every ellipsoid has a chunk: one that reaches nothing still takes a step, of zero.
    chunks[reached.ellipsoid] = n == 0 ? 1 : (n - 1) / PairListsView::kChunk + 1;
  });
}

/// Bits of a sort key that rank the entries of a brick by their number of lines. Entries with the
/// largest number come first, and neighbours take about the same, so that the lanes of a warp end
/// at the same time.
constexpr int kLinesBits = 3;

__device__ int voxelsOfBrick(double center, double half, std::int32_t brick) {
  const double first = double(brick) * kBrickSide, last = first + kBrickSide - 1;
  const double low = fmax(ceil(center - half), first), high = fmin(floor(center + half), last);
  return max(int(high - low) + 1, 1);
}

/// The rank of an entry, from 0 for all lines of a brick to 7 for few.
__device__ std::uint32_t linesRank(const Support& s, Coord brick) {
  const int lines = voxelsOfBrick(s.center[0], s.half[0], brick.x) *
                    voxelsOfBrick(s.center[2], s.half[2], brick.z);
  return std::uint32_t(kBrickSide * kBrickSide - lines) >> (2 * kBrickLog2 - kLinesBits);
}

__global__ void listPairsKernel(SupportSource source, BrickTableView bricks,
                                const std::uint32_t* begin, std::uint32_t* key, std::uint32_t* pair,
                                std::uint32_t* owner) {
  walkReachedBricks(source, bricks.bounds, [&](const auto& reached) {
    visitPairs(reached, bricks, [&](std::uint32_t number, Coord brick, std::uint32_t n) {
      const std::uint32_t at = begin[reached.ellipsoid] + n;
      key[at] = number << kLinesBits | linesRank(reached.support, brick);
      pair[at] = at;
      owner[at] = std::uint32_t(reached.ellipsoid);
    });
  });
}

__global__ void listChunks(const std::uint32_t* begin, std::uint32_t ellipsoids,
                           std::uint32_t* owner) {
  const std::size_t i = threadNumber();
  if (i >= ellipsoids) return;
  for (std::uint32_t c = begin[i]; c < begin[i + 1]; ++c) owner[c] = std::uint32_t(i);
}

/// Finds where the entries of each brick begin in the sorted keys.
__global__ void findBrickBegins(const std::uint32_t* sorted, std::uint32_t entries,
                                std::uint32_t bricks, std::uint32_t* begin) {
  const std::size_t k = threadNumber();
  if (k > entries) return;
  const std::uint32_t first = k == 0 ? 0 : (sorted[k - 1] >> kLinesBits) + 1;
  const std::uint32_t last = k == entries ? bricks : sorted[k] >> kLinesBits;
  for (std::uint32_t b = first; b <= last; ++b) begin[b] = std::uint32_t(k);
}

__global__ void gatherOwners(const std::uint32_t* pair, const std::uint32_t* owner,
                             std::uint32_t entries, std::uint32_t* ellipsoid) {
  const std::size_t k = threadNumber();
  if (k < entries) ellipsoid[k] = owner[pair[k]];
}

constexpr int kRankBits = 8;

/// The rank of a brick with n pairs, below 2^kRankBits. Numbers within an eighth of a power of two
/// share a rank.
__device__ std::uint32_t pairsRank(std::uint32_t n) {
  constexpr int kEighths = 3;
  if (n == 0) return 0;
  const int exponent = 31 - __clz(int(n));  // the highest bit that is set
  const std::uint64_t eighths = (std::uint64_t{n} << kEighths) >> exponent;  // 8 to 15
  return std::uint32_t(exponent) << kEighths | std::uint32_t(eighths & 7u);
}

__global__ void rankBricks(const std::uint32_t* begin, std::uint32_t bricks, std::uint32_t* rank,
                           std::uint32_t* brick) {
  const std::size_t b = threadNumber();
  if (b >= bricks) return;
  rank[b] = pairsRank(begin[b + 1] - begin[b]);
  brick[b] = std::uint32_t(b);
}

}  // namespace

PairLists::PairLists(cudaStream_t stream)
    : stream_(stream),
      counts_(stream),
      chunkCounts_(stream),
      ellipsoidBegin_(stream),
      chunkBegin_(stream),
      chunkOwner_(stream),
      key_(stream),
      keySorted_(stream),
      pair_(stream),
      pairSorted_(stream),
      owner_(stream),
      ellipsoid_(stream),
      brickBegin_(stream),
      brickRank_(stream),
      brickRankSorted_(stream),
      bricks_(stream),
      brickOrder_(stream),
      total_(stream),
      temporary_(stream) {}

void PairLists::countPairs(const SupportSource& supports, const BrickTableView& bricks) {
  const std::size_t n = supports.count;
  std::uint32_t* const counts = counts_.reserve(n + 1);
  std::uint32_t* const chunks = chunkCounts_.reserve(n + 1);
  check(cudaMemsetAsync(counts + n, 0, sizeof(*counts), stream_), "clearing a counter");
  check(cudaMemsetAsync(chunks + n, 0, sizeof(*chunks), stream_), "clearing a counter");
  if (n > 0)
    countPairsKernel<<<blocksFor(n * kWarp, kBlock), kBlock, 0, stream_>>>(supports, bricks, counts,
                                                                           chunks);
  check(cudaGetLastError(), "counting pairs");
  const auto sum = [&](std::uint32_t* from, std::uint32_t* to) {
    withTemporary(temporary_, "summing counts", [&](void* memory, std::size_t& bytes) {
      return cub::DeviceScan::ExclusiveSum(memory, bytes, from, to, n + 1, stream_);
    });
  };
  sum(counts, ellipsoidBegin_.reserve(n + 1));
  sum(chunks, chunkBegin_.reserve(n + 1));
}

void PairLists::readTotals(std::size_t n) {
  // The totals have 64 bits, so that an overflow of the 32-bit prefix sums is detected.
  total_.reserve(2);
  withTemporary(temporary_, "summing counts", [&](void* memory, std::size_t& bytes) {
    return cub::DeviceReduce::Reduce(memory, bytes, counts_.data(), total_.data(), n + 1,
                                     ::cuda::std::plus<std::uint64_t>{}, std::uint64_t{0}, stream_);
  });
  withTemporary(temporary_, "summing counts", [&](void* memory, std::size_t& bytes) {
    return cub::DeviceReduce::Reduce(memory, bytes, chunkCounts_.data(), total_.data() + 1, n + 1,
                                     ::cuda::std::plus<std::uint64_t>{}, std::uint64_t{0}, stream_);
  });
  std::array<std::uint64_t, 2> totals{};
  downloadTo(std::span<std::uint64_t>(totals), total_.data(), stream_);
  pairCount_ = count32(totals[0], "pairs of ellipsoids and bricks");
  chunkCount_ = count32(totals[1], "chunks of pairs");
}

void PairLists::listPairs(const SupportSource& supports, const BrickTableView& bricks) {
  const std::size_t n = supports.count;
  std::uint32_t* const key = key_.reserve(pairCount_);
  std::uint32_t* const pair = pair_.reserve(pairCount_);
  std::uint32_t* const owner = owner_.reserve(pairCount_);
  std::uint32_t* const chunkOwner = chunkOwner_.reserve(chunkCount_);
  if (n == 0) return;
  listPairsKernel<<<blocksFor(n * kWarp, kBlock), kBlock, 0, stream_>>>(
      supports, bricks, ellipsoidBegin_.data(), key, pair, owner);
  check(cudaGetLastError(), "listing pairs");
  listChunks<<<blocksFor(n, kBlock), kBlock, 0, stream_>>>(chunkBegin_.data(), std::uint32_t(n),
                                                           chunkOwner);
  check(cudaGetLastError(), "listing chunks of pairs");
}

void PairLists::sortByBrick(std::size_t bricks) {
  const auto entries = std::uint32_t(pairCount_);
  std::uint32_t* const sorted = keySorted_.reserve(pairCount_);
  std::uint32_t* const pair = pairSorted_.reserve(pairCount_);
  if (entries > 0)
    withTemporary(temporary_, "sorting pairs", [&](void* memory, std::size_t& bytes) {
      // The sort is stable: ellipsoids with the same number of lines keep their order.
      return cub::DeviceRadixSort::SortPairs(memory, bytes, key_.data(), sorted, pair_.data(), pair,
                                             pairCount_, 0,
                                             int(std::bit_width(bricks)) + kLinesBits, stream_);
    });
  findBrickBegins<<<blocksFor(pairCount_ + 1, kBlock), kBlock, 0, stream_>>>(
      sorted, entries, std::uint32_t(bricks), brickBegin_.reserve(bricks + 1));
  check(cudaGetLastError(), "finding the pairs of bricks");
  std::uint32_t* const ellipsoid = ellipsoid_.reserve(pairCount_);
  if (entries > 0)
    gatherOwners<<<blocksFor(pairCount_, kBlock), kBlock, 0, stream_>>>(pair, owner_.data(),
                                                                        entries, ellipsoid);
  check(cudaGetLastError(), "listing the ellipsoids of bricks");
}

/// Orders the bricks by the rank of their number of pairs, the largest first. Blocks start in this
/// order, so that no long brick begins when all others are done. Bricks of one rank keep their
/// order in space, so that blocks that run at the same time read the same ellipsoids.
void PairLists::orderBricks(std::size_t bricks) {
  if (bricks == 0) return;
  std::uint32_t* const rank = brickRank_.reserve(bricks);
  std::uint32_t* const sorted = brickRankSorted_.reserve(bricks);
  std::uint32_t* const brick = bricks_.reserve(bricks);
  std::uint32_t* const order = brickOrder_.reserve(bricks);
  rankBricks<<<blocksFor(bricks, kBlock), kBlock, 0, stream_>>>(brickBegin_.data(),
                                                                std::uint32_t(bricks), rank, brick);
  check(cudaGetLastError(), "ranking bricks");
  withTemporary(temporary_, "ordering bricks", [&](void* memory, std::size_t& bytes) {
    return cub::DeviceRadixSort::SortPairsDescending(memory, bytes, rank, sorted, brick, order,
                                                     bricks, 0, kRankBits, stream_);
  });
}

void PairLists::rebuild(const SupportSource& supports, const BrickTable& bricks) {
  constexpr std::size_t kMaxBricks = std::size_t{1} << (32 - kLinesBits);
  if (bricks.size() >= kMaxBricks)
    throw DeviceError("fitting on the GPU: " + std::to_string(bricks.size()) +
                      " bricks are more than the lists can hold");
  countPairs(supports, bricks.view());
  readTotals(supports.count);
  listPairs(supports, bricks.view());
  sortByBrick(bricks.size());
  orderBricks(bricks.size());
}

PairListsView PairLists::view() const {
  return {brickOrder_.data(),     brickBegin_.data(), ellipsoid_.data(), pairSorted_.data(),
          ellipsoidBegin_.data(), chunkBegin_.data(), chunkOwner_.data()};
}

}  // namespace esvr::cuda
