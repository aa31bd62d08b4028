#include "render/slot_list.h"

#include <algorithm>

namespace esvr {

void SlotList::grow(std::uint32_t slots) {
  const auto first = std::uint32_t(ownerOf_.size());
  ownerOf_.resize(ownerOf_.size() + slots, kNobody);
  for (std::uint32_t n = slots; n > 0; --n) free_.push_back(first + n - 1);
}

std::uint32_t SlotList::take(std::uint32_t brick) {
  const std::uint32_t slot = free_.back();
  free_.pop_back();
  ownerOf_[slot] = brick;
  return slot;
}

void SlotList::giveBack(std::uint32_t slot) {
  ownerOf_[slot] = kNobody;
  free_.push_back(slot);
}

std::vector<std::uint32_t> SlotList::evict(std::size_t count,
                                           std::span<const std::uint32_t> stamps) {
  std::vector<std::uint32_t> owned;
  for (std::uint32_t slot = 0; slot < ownerOf_.size(); ++slot)
    if (ownerOf_[slot] != kNobody) owned.push_back(slot);
  count = std::min(count, owned.size());
  std::ranges::nth_element(owned, owned.begin() + std::ptrdiff_t(count), {},
                           [&](std::uint32_t slot) { return stamps[slot]; });
  std::vector<std::uint32_t> bricks;
  for (std::size_t n = 0; n < count; ++n) {
    bricks.push_back(ownerOf_[owned[n]]);
    giveBack(owned[n]);
  }
  return bricks;
}

}  // namespace esvr
