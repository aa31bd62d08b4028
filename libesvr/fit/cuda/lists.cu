#include <algorithm>
#include <array>
#include <bit>
#include <cub/device/device_merge_sort.cuh>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_reduce.cuh>
#include <cub/device/device_scan.cuh>

#include "core/cuda/device_buffer.h"
#include "core/cuda/reduce.cuh"
#include "core/cuda/runtime.h"
#include "fit/cuda/lists.h"

namespace esvr::cuda {
namespace {

// --- The bricks that ellipsoids reach. A warp visits the bricks around one ellipsoid. If these are
// many, a whole block visits them, because otherwise the few largest ellipsoids would keep single
// warps busy long after all others have ended.

constexpr int kWarpsOfBlock = kBlock / kWarp;

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

// --- The table of bricks.

constexpr std::size_t kMinReachedSlots = std::size_t{1} << 12;

/// Largest number of slots that are probed for a brick. A table that is at most half full never
/// needs so many: in one with 2^24 slots the longest probe has a length of about 90.
constexpr int kMaxProbes = 256;

__global__ void insertTargets(const Coord* bricks, std::uint32_t count, std::uint32_t* slots,
                              std::uint32_t mask) {
  const std::size_t number = threadNumber();
  if (number >= count) return;
  std::uint32_t s = std::uint32_t(hashOf(bricks[number])) & mask;
  while (atomicCAS(&slots[s], kNoBrick, std::uint32_t(number)) != kNoBrick) s = (s + 1) & mask;
}

/// The table into which kernels insert bricks. If the table is too small, `count` ends above
/// maxCount.
struct ReachedInsertion {
  ReachedSlot* slots;
  std::uint32_t mask;
  std::uint32_t maxCount;
  std::uint32_t* count;
  BrickTableView targets;  ///< target bricks, which are not inserted
  Box within;              ///< bricks outside are not inserted
};

/// Waits until a claimed slot holds its brick. \return true if that is the given brick
__device__ bool holds(ReachedSlot& slot, Coord brick) {
  volatile int* const state = &slot.state;
  while (*state != ReachedSlot::kReady) __nanosleep(20);
  __threadfence();
  const volatile Coord& there = slot.brick;
  return there.x == brick.x && there.y == brick.y && there.z == brick.z;
}

/// Claims an empty slot for a brick. \return false if another thread has claimed it before
__device__ bool claim(ReachedSlot& slot, Coord brick, std::uint32_t* count) {
  if (atomicCAS(&slot.state, ReachedSlot::kEmpty, ReachedSlot::kBeingWritten) !=
      ReachedSlot::kEmpty)
    return false;
  slot.brick = brick;
  __threadfence();
  atomicExch(&slot.state, ReachedSlot::kReady);
  atomicAdd(count, 1u);
  return true;
}

__device__ bool tooSmall(const ReachedInsertion& into) {
  return *static_cast<volatile std::uint32_t*>(into.count) > into.maxCount;
}

/// Claims a slot for a brick, unless the brick has one. Threads that begin at the same time can
/// fill the table before any of them sees the count, so the length of a probe is limited too.
__device__ void insertReached(const ReachedInsertion& into, Coord brick) {
  const auto hash = std::uint32_t(hashOf(brick));
  if (!into.within.contains(brick) || into.targets.findTarget(brick, hash) != kNoBrick) return;
  for (int probe = 0; probe < kMaxProbes; ++probe) {
    ReachedSlot& slot = into.slots[(hash + std::uint32_t(probe)) & into.mask];
    const bool empty = *static_cast<volatile int*>(&slot.state) == ReachedSlot::kEmpty;
    if (empty && tooSmall(into)) return;
    if ((empty && claim(slot, brick, into.count)) || holds(slot, brick)) return;
  }
  atomicMax(into.count, into.maxCount + 1);
}

__global__ void collectReached(SupportSource source, ReachedInsertion into) {
  walkReachedBricks(source, into.within, [&](const auto& bricks) {
    bricks.visit([&](Coord brick, bool reached) {
      if (reached) insertReached(into, brick);
    });
  });
}

constexpr int kNeighbours = 27;  // including the brick itself

__global__ void collectAround(const Coord* bricks, std::uint32_t count, ReachedInsertion into) {
  const std::size_t n = threadNumber();
  if (n >= std::size_t(count) * kNeighbours) return;
  const int side = int(n % kNeighbours);
  insertReached(into,
                bricks[n / kNeighbours] + Coord{side / 9 - 1, side / 3 % 3 - 1, side % 3 - 1});
}

/// Lists the reached bricks in any order. They are sorted afterwards.
__global__ void listReached(const ReachedSlot* slots, std::uint32_t slotCount, Coord* out,
                            std::uint32_t* count) {
  const std::size_t s = threadNumber();
  if (s < slotCount && slots[s].state == ReachedSlot::kReady)
    out[atomicAdd(count, 1u)] = slots[s].brick;
}

__global__ void numberReached(const Coord* sorted, std::uint32_t count, std::uint32_t first,
                              ReachedSlot* slots, std::uint32_t mask) {
  const std::size_t n = threadNumber();
  if (n >= count) return;
  std::uint32_t s = std::uint32_t(hashOf(sorted[n])) & mask;
  while (!sameBrick(slots[s].brick, sorted[n])) s = (s + 1) & mask;
  slots[s].number = first + std::uint32_t(n);
}

struct InOrder {
  __host__ __device__ bool operator()(const Coord& a, const Coord& b) const {
    if (a.x != b.x) return a.x < b.x;
    return a.y != b.y ? a.y < b.y : a.z < b.z;
  }
};

}  // namespace

BrickTable::BrickTable(std::span<const Coord> targetBricks, cudaStream_t stream)
    : stream_(stream),
      targetCount_(count32(targetBricks.size(), "bricks")),
      bricks_(stream),
      slots_(stream),
      reachedSlots_(stream),
      counter_(stream),
      temporary_(stream) {
  for (const Coord brick : targetBricks) targetBounds_.expand(brick);
  bounds_ = targetBounds_;
  uploadTo(bricks_.reserve(targetCount_), targetBricks, stream);
  counter_.reserve(1);
  slotCount_ = slotsFor(targetCount_);
  std::uint32_t* const slots = slots_.reserve(slotCount_);
  check(cudaMemsetAsync(slots, 0xff, slotCount_ * sizeof(*slots), stream_), "clearing a table");
  if (targetCount_ == 0) return;
  insertTargets<<<blocksFor(targetCount_, kBlock), kBlock, 0, stream_>>>(
      bricks_.data(), std::uint32_t(targetCount_), slots, std::uint32_t(slotCount_ - 1));
  check(cudaGetLastError(), "filling the table of bricks");
}

/// \param launch  launch(insertion) starts the kernel that inserts the bricks
/// \return false if the table was too small
template <class Launch>
bool BrickTable::collect(const Box& within, Launch&& launch) {
  ReachedSlot* const slots = reachedSlots_.reserve(reachedSlotCount_);
  check(cudaMemsetAsync(slots, 0, reachedSlotCount_ * sizeof(*slots), stream_), "clearing a table");
  check(cudaMemsetAsync(counter_.data(), 0, sizeof(std::uint32_t), stream_), "clearing a counter");
  const auto maxCount = std::uint32_t(reachedSlotCount_ / 2);
  launch(ReachedInsertion{slots, std::uint32_t(reachedSlotCount_ - 1), maxCount, counter_.data(),
                          view(), within});
  check(cudaGetLastError(), "finding reached bricks");
  reachedCount_ = downloadValue(counter_.data(), stream_);
  return reachedCount_ <= maxCount;
}

void BrickTable::number() {
  if (reachedCount_ == 0) return;
  Coord* const reached = bricks_.extend(size(), targetCount_) + targetCount_;
  const auto slotCount = std::uint32_t(reachedSlotCount_);
  check(cudaMemsetAsync(counter_.data(), 0, sizeof(std::uint32_t), stream_), "clearing a counter");
  listReached<<<blocksFor(slotCount, kBlock), kBlock, 0, stream_>>>(reachedSlots_.data(), slotCount,
                                                                    reached, counter_.data());
  check(cudaGetLastError(), "listing reached bricks");
  withTemporary(temporary_, "sorting reached bricks", [&](void* memory, std::size_t& bytes) {
    return cub::DeviceMergeSort::SortKeys(memory, bytes, reached, reachedCount_, InOrder{},
                                          stream_);
  });
  numberReached<<<blocksFor(reachedCount_, kBlock), kBlock, 0, stream_>>>(
      reached, std::uint32_t(reachedCount_), std::uint32_t(targetCount_), reachedSlots_.data(),
      slotCount - 1);
  check(cudaGetLastError(), "numbering reached bricks");
}

void BrickTable::forgetReached() {
  reachedCount_ = 0;
  bounds_ = targetBounds_;
}

/// \param expected  expected number of reached bricks; the table grows if there are more
template <class Launch>
void BrickTable::find(std::size_t expected, const Box& within, Launch&& launch) {
  reachedSlotCount_ = std::max({reachedSlotCount_, kMinReachedSlots, slotsFor(expected)});
  while (!collect(within, launch))
    reachedSlotCount_ = count32(4 * reachedSlotCount_, "slots of a table of bricks");
  (void)count32(size(), "bricks");
  if (reachedCount_ > 0) bounds_.expand(within);
  number();
}

void BrickTable::findReached(const SupportSource& supports, const Box& within) {
  forgetReached();
  if (supports.count == 0) return;
  find(targetCount_, within, [&](const ReachedInsertion& into) {
    collectReached<<<blocksFor(supports.count * kWarp, kBlock), kBlock, 0, stream_>>>(supports,
                                                                                      into);
  });
}

void BrickTable::findAround(const BrickTable& other, const Box& within) {
  forgetReached();
  if (other.size() == 0) return;
  find(2 * other.size(), within, [&](const ReachedInsertion& into) {
    collectAround<<<blocksFor(other.size() * kNeighbours, kBlock), kBlock, 0, stream_>>>(
        other.bricks_.data(), std::uint32_t(other.size()), into);
  });
}

BrickTableView BrickTable::view() const {
  return {bricks_.data(),
          slots_.data(),
          std::uint32_t(slotCount_ - 1),
          reachedSlots_.data(),
          std::uint32_t(reachedSlotCount_ - 1),
          reachedCount_ > 0,
          bounds_};
}

// --- The pair lists.

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
