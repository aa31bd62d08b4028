#include "render/cuda/brick_cache.h"

#include <algorithm>
#include <span>

#include "core/brick_index.h"
#include "core/cuda/copy.h"
#include "render/oldest_slots.h"

namespace esvr::cuda {
namespace {

/// Missing bricks that a ray asks for besides the one at which it waits. More need fewer passes, but
/// decode bricks that an opaque one may hide. A ray that has waited before is not stopped soon, and
/// asks for four times as many.
constexpr int kAhead = 16, kMostPasses = 4;

static_assert(CellFieldView::kNoRule == BrickIndex::kNone, "masks are numbered by brick");

LevelBricks bricksOf(const DeviceLevel& level) {
  return {level.table().origin, level.first(), level.count(), level.bricks()};
}

}  // namespace

DeviceCells::DeviceCells(const CellField& field, cudaStream_t stream)
    : rule_(field.rule),
      box_(field.box),
      forms_(field.forms, stream),
      kernels_(field.kernels, stream),
      origins_(field.origins, stream),
      begin_(field.begin, stream),
      ellipsoid_(field.ellipsoid, stream),
      corners_(field.corners, stream),
      masks_(field.masks, stream),
      blockLevels_(field.blockLevels, stream),
      ruleOf_(field.ruleOf, stream) {
  add(DeviceLevel(field.table, stream));
}

CellFieldView DeviceCells::view() const {
  CellFieldView view{.table = level(0).table(),
                     .levels = {},
                     .forms = forms_.data(),
                     .kernels = kernels_.data(),
                     .kernelStride = kernels_.size() > 1 ? 1u : 0u,
                     .origins = origins_.data(),
                     .begin = begin_.data(),
                     .ellipsoid = ellipsoid_.data(),
                     .corners = corners_.data(),
                     .masks = masks_.data(),
                     .blockLevels = blockLevels_.data(),
                     .ruleOf = ruleOf_.data(),
                     .box = box_,
                     .rule = rule_};
  for (int l = 0; l < levelCount(); ++l) view.levels[l] = bricksOf(level(l));
  return view;
}

std::size_t DeviceCells::bytes() const {
  std::size_t bytes = forms_.bytes() + kernels_.bytes() + origins_.bytes() + begin_.bytes() +
                      ellipsoid_.bytes() + corners_.bytes() + masks_.bytes() +
                      blockLevels_.bytes() + ruleOf_.bytes();
  for (const DeviceLevel& level : levels_) bytes += level.bytes();
  return bytes;
}

BrickCache::BrickCache(const DeviceCells& cells, cudaStream_t stream)
    : cells_(cells),
      stream_(stream),
      pageTable_(stream),
      owners_(stream),
      stamps_(stream),
      free_(stream),
      spare_(stream),
      occupied_(stream),
      counts_(1, stream) {
  number();
}

void BrickCache::number() {
  makeRoom(slotOf_, cells_.brickCount(), stream_);
  makeRoom(asked_, cells_.brickCount(), stream_);
  forget();
}

SlotAccount BrickCache::account() {
  return {slotOf_.data(),
          owners_.data(),
          stamps_.data(),
          free_.data(),
          spare_.data(),
          counts_.data(),
          now_};
}

void BrickCache::forget() {
  counts_.setZero();
  launchSetAll(slotOf_.data(), cells_.brickCount(), BrickSlotsView::kMissing, stream_);
  launchAddFree(account(), 0, slotCount(), 0, stream_);
}

BrickDemand BrickCache::demand(int pass) {
  check(cudaMemsetAsync(counts_.data(), 0, 2 * sizeof(std::uint32_t), stream_), "clearing counts");
  return {.counts = counts_.data(),
          .slotOf = slotOf_.data(),
          .bricks = asked_.data(),
          .stamps = maxBytes_ == 0 ? nullptr : stamps_.data(),
          .now = ++now_,
          .ahead = crowded_ ? 0 : kAhead << 2 * std::min(pass, kMostPasses)};
}

BrickDemand::Counts BrickCache::counts() { return downloaded_.download(counts_.data(), stream_); }

void BrickCache::serve(const BrickDemand::Counts& counts, const LevelBounds& levels) {
  const std::uint32_t free = makeRoomFor(counts.bricks, counts.free);
  const std::uint32_t served = std::min(counts.bricks, free);
  // A ray that asks for the brick at which it waits, and no other, makes progress with each brick.
  crowded_ = served < counts.bricks;
  launchMakeMissing(account(), asked_.data() + served, counts.bricks - served, stream_);
  decode(served, free, levels);
}

/// Adds pages, or drops bricks where there cannot be more pages. \return the number of free slots
std::uint32_t BrickCache::makeRoomFor(std::uint32_t bricks, std::uint32_t free) {
  while (free < bricks && addPage(free)) free += BrickSlotsView::kPageSlots;
  return free < bricks ? free + evict(bricks - free, free) : free;
}

bool BrickCache::mayAddPage() const {
  return pages_.empty() || maxBytes_ == 0 || (pages_.size() + 1) * kPageBytes <= maxBytes_;
}

/// \param free  number of free slots before
/// \return false if there is no memory for a further page
bool BrickCache::addPage(std::uint32_t free) {
  if (!mayAddPage()) return false;
  const std::uint32_t before = slotCount();
  try {
    DeviceBuffer<float> page(BrickSlotsView::kPageFloats, stream_);
    extendTables(page.data());
    pages_.push_back(std::move(page));
  } catch (const DeviceMemoryError&) {
    if (pages_.empty()) throw;
    maxBytes_ = pages_.size() * kPageBytes;
    return false;
  }
  launchAddFree(account(), before, BrickSlotsView::kPageSlots, free, stream_);
  return true;
}

void BrickCache::extendTables(float* page) {
  const std::size_t before = slotCount(), after = before + BrickSlotsView::kPageSlots;
  float** const table = pageTable_.extend(pages_.size() + 1, pages_.size());
  uploadTo(table + pages_.size(), std::span<float* const>(&page, 1), stream_);
  (void)owners_.extend(after, before);
  (void)stamps_.extend(after, before);
  (void)free_.extend(after, before);
  (void)spare_.reserve(after);
}

/// Drops the bricks that were not read for the longest time. \return how many
std::uint32_t BrickCache::evict(std::uint32_t bricks, std::uint32_t free) {
  std::vector<std::uint32_t> owners(slotCount()), stamps(slotCount());
  downloadTo(std::span(owners), owners_.data(), stream_);
  downloadTo(std::span(stamps), stamps_.data(), stream_);
  const auto slots = oldestSlots(bricks, owners, stamps);
  uploadTo(spare_.data(), std::span<const std::uint32_t>(slots), stream_);
  launchDrop(account(), spare_.data(), std::uint32_t(slots.size()), free, stream_);
  return std::uint32_t(slots.size());
}

void BrickCache::decode(std::uint32_t bricks, std::uint32_t free, const LevelBounds& levels) {
  if (bricks == 0) return;
  std::uint8_t* const occupied = occupied_.reserve(bricks);
  check(cudaMemsetAsync(occupied, 0, bricks, stream_), "clearing marks");
  const DecodeArguments arguments{.field = cells_.view(),
                                  .bricks = asked_.data(),
                                  .count = bricks,
                                  .lastSlot = free_.data() + free - 1,
                                  .pages = pageTable_.data(),
                                  .occupied = occupied};
  for (int level = levels.first; level <= levels.last; ++level)
    launchDecode(arguments, level, stream_);
  launchSettle(account(), {asked_.data(), bricks, free, occupied}, stream_);
}

std::size_t BrickCache::bytes() const {
  return pages_.size() * BrickSlotsView::kPageFloats * sizeof(float) + pageTable_.bytes() +
         slotOf_.bytes() + asked_.bytes() + owners_.bytes() + stamps_.bytes() + free_.bytes() +
         spare_.bytes() + occupied_.bytes();
}

}  // namespace esvr::cuda
