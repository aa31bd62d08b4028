#include "render/cuda/brick_cache.h"

#include <algorithm>
#include <span>

#include "core/cuda/copy.h"

namespace esvr::cuda {
namespace {

/// Missing bricks that a ray asks for besides the one at which it waits. More need fewer passes,
/// but decode bricks that an opaque one may hide.
constexpr int kAhead = 4;

}  // namespace

DeviceCells::DeviceCells(const CellField& field, cudaStream_t stream)
    : origin_(field.table.origin),
      blocks_(field.table.blocks),
      rule_(field.rule),
      blockOf_(field.table.blockOf, stream),
      brickOf_(field.table.brickOf, stream),
      bricks_(field.table.bricks, stream),
      forms_(field.forms, stream),
      kernels_(field.kernels, stream),
      origins_(field.origins, stream),
      begin_(field.begin, stream),
      ellipsoid_(field.ellipsoid, stream),
      corners_(field.corners, stream) {}

CellFieldView DeviceCells::view() const {
  return {.origin = origin_,
          .bricks = bricks_.data(),
          .forms = forms_.data(),
          .kernels = kernels_.data(),
          .kernelStride = kernels_.size() > 1 ? 1u : 0u,
          .origins = origins_.data(),
          .begin = begin_.data(),
          .ellipsoid = ellipsoid_.data(),
          .corners = corners_.data(),
          .rule = rule_};
}

std::size_t DeviceCells::bytes() const {
  return blockOf_.bytes() + brickOf_.bytes() + bricks_.bytes() + forms_.bytes() + kernels_.bytes() +
         origins_.bytes() + begin_.bytes() + ellipsoid_.bytes() + corners_.bytes();
}

BrickCache::BrickCache(const DeviceCells& cells, cudaStream_t stream)
    : cells_(cells),
      stream_(stream),
      pageTable_(stream),
      slotOf_(cells.count(), stream),
      asked_(cells.count(), stream),
      counts_(1, stream),
      stamps_(stream),
      changes_(stream),
      occupied_(stream) {
  forget();
}

void BrickCache::forget() {
  const std::vector<std::uint32_t> missing(slotOf_.size(), BrickSlotsView::kMissing);
  slotOf_.upload(missing);
  list_ = {};
  list_.grow(std::uint32_t(pages_.size()) * BrickSlotsView::kPageSlots);
}

BrickDemand BrickCache::demand() {
  counts_.setZero();
  return {.counts = counts_.data(),
          .slotOf = slotOf_.data(),
          .bricks = asked_.data(),
          .stamps = maxBytes_ == 0 ? nullptr : stamps_.data(),
          .now = ++now_,
          .ahead = crowded_ ? 0 : kAhead};
}

BrickDemand::Counts BrickCache::counts() { return downloaded_.download(counts_.data(), stream_); }

void BrickCache::serve(std::uint32_t asked) {
  std::vector<std::uint32_t> bricks(asked);
  downloadTo(std::span(bricks), asked_.data(), stream_);
  makeRoomFor(bricks.size());
  const std::size_t served = std::min(bricks.size(), list_.freeCount());
  // A ray that asks for the brick at which it waits, and no other, makes progress with each brick.
  crowded_ = served < bricks.size();
  std::vector<SlotOfBrick> wanted, others;
  for (std::size_t i = 0; i < bricks.size(); ++i)
    if (i < served)
      wanted.push_back({bricks[i], list_.take(bricks[i])});
    else
      others.push_back({bricks[i], BrickSlotsView::kMissing});
  set(std::move(others));
  decode(wanted);
}

/// Adds pages, or drops bricks where there cannot be more pages.
void BrickCache::makeRoomFor(std::size_t bricks) {
  while (list_.freeCount() < bricks)
    if (!addPage()) break;
  if (list_.freeCount() < bricks) evict(bricks - list_.freeCount());
}

/// \return false if there is no memory for a further page
bool BrickCache::addPage() {
  const bool isFirst = pages_.empty();
  if (!isFirst && maxBytes_ != 0 && (pages_.size() + 1) * kPageBytes > maxBytes_) return false;
  try {
    pages_.emplace_back(BrickSlotsView::kPageFloats, stream_);
    float* const page = pages_.back().data();
    float** const table = pageTable_.extend(pages_.size(), pages_.size() - 1);
    uploadTo(table + pages_.size() - 1, std::span<float* const>(&page, 1), stream_);
    const std::size_t before = list_.size();
    std::uint32_t* const stamps = stamps_.extend(before + BrickSlotsView::kPageSlots, before);
    check(
        cudaMemsetAsync(stamps + before, 0, BrickSlotsView::kPageSlots * sizeof(*stamps), stream_),
        "clearing times");
  } catch (const DeviceMemoryError&) {
    if (isFirst) throw;
    pages_.resize(list_.size() / BrickSlotsView::kPageSlots);
    maxBytes_ = pages_.size() * kPageBytes;
    return false;
  }
  list_.grow(BrickSlotsView::kPageSlots);
  return true;
}

void BrickCache::evict(std::size_t bricks) {
  std::vector<std::uint32_t> stamps(list_.size());
  downloadTo(std::span(stamps), stamps_.data(), stream_);
  std::vector<SlotOfBrick> dropped;
  for (const std::uint32_t brick : list_.evict(bricks, stamps))
    dropped.push_back({brick, BrickSlotsView::kMissing});
  set(std::move(dropped));
}

void BrickCache::set(std::vector<SlotOfBrick> changes) {
  if (changes.empty()) return;
  SlotOfBrick* const there = changes_.reserve(changes.size());
  uploadTo(there, std::span<const SlotOfBrick>(changes), stream_);
  launchSetSlots(there, std::uint32_t(changes.size()), slotOf_.data(), stream_);
}

void BrickCache::decode(const std::vector<SlotOfBrick>& wanted) {
  if (wanted.empty()) return;
  SlotOfBrick* const there = changes_.reserve(wanted.size());
  uploadTo(there, std::span<const SlotOfBrick>(wanted), stream_);
  std::uint8_t* const occupied = occupied_.reserve(wanted.size());
  launchDecode({.field = cells_.view(),
                .wanted = there,
                .count = std::uint32_t(wanted.size()),
                .pages = pageTable_.data(),
                .slotOf = slotOf_.data(),
                .occupied = occupied},
               stream_);
  std::vector<std::uint8_t> any(wanted.size());
  downloadTo(std::span(any), occupied, stream_);
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (any[i] == 0) list_.giveBack(wanted[i].slot);
}

std::size_t BrickCache::bytes() const {
  return pages_.size() * kPageBytes + pageTable_.bytes() + slotOf_.bytes() + asked_.bytes() +
         stamps_.bytes() + changes_.bytes() + occupied_.bytes();
}

}  // namespace esvr::cuda
