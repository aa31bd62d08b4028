#pragma once
/// Chooses the slots (BrickSlotsView) that bricks leave when memory is short.

#include <cstdint>
#include <span>
#include <vector>

namespace esvr {

/// Owner of a slot that is free.
inline constexpr std::uint32_t kNoOwner = 0xffffffffu;

/// The slots that have not been read for the longest time.
/// \param count   number of slots to choose; all that have an owner if there are fewer
/// \param owners  by slot: its brick, or kNoOwner
/// \param stamps  by slot: time of the last reading
[[nodiscard]] std::vector<std::uint32_t> oldestSlots(std::size_t count,
                                                     std::span<const std::uint32_t> owners,
                                                     std::span<const std::uint32_t> stamps);

}  // namespace esvr
