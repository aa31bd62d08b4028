#pragma once
/// Keeps account of which brick has which slot (BrickSlotsView).

#include <cstdint>
#include <span>
#include <vector>

namespace esvr {

class SlotList {
 public:
  [[nodiscard]] std::size_t size() const { return ownerOf_.size(); }
  [[nodiscard]] std::size_t freeCount() const { return free_.size(); }

  /// Adds free slots.
  void grow(std::uint32_t slots);
  /// Gives a free slot to a brick; there must be one.
  [[nodiscard]] std::uint32_t take(std::uint32_t brick);
  void giveBack(std::uint32_t slot);
  /// Frees the slots that have not been read for the longest time.
  /// \param count   number of slots to free; all slots that have an owner if there are fewer
  /// \param stamps  time of the last reading of each slot
  /// \return the bricks that had these slots
  [[nodiscard]] std::vector<std::uint32_t> evict(std::size_t count,
                                                 std::span<const std::uint32_t> stamps);

 private:
  static constexpr std::uint32_t kNobody = 0xffffffffu;

  std::vector<std::uint32_t> ownerOf_;  ///< by slot: its brick, or kNobody
  std::vector<std::uint32_t> free_;
};

}  // namespace esvr
