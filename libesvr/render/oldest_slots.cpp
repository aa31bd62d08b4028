#include "render/oldest_slots.h"

#include <algorithm>

namespace esvr {

std::vector<std::uint32_t> oldestSlots(std::size_t count, std::span<const std::uint32_t> owners,
                                       std::span<const std::uint32_t> stamps) {
  std::vector<std::uint32_t> owned;
  for (std::uint32_t slot = 0; slot < owners.size(); ++slot)
    if (owners[slot] != kNoOwner) owned.push_back(slot);
  count = std::min(count, owned.size());
  std::ranges::nth_element(owned, owned.begin() + std::ptrdiff_t(count), {},
                           [&](std::uint32_t slot) { return stamps[slot]; });
  owned.resize(count);
  return owned;
}

}  // namespace esvr
