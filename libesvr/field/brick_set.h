#pragma once
/// A set of bricks, which are stored as bits in blocks of 8^3 bricks. Its memory follows the number
/// of blocks, however often a brick is inserted.

#include <unordered_map>
#include <vector>

#include "core/brick_hash.h"
#include "esvr/sparse_volume.h"

namespace esvr {

class BrickSet {
 public:
  void insert(Coord brick) {
    BrickMask& block = blockAt(brickOf(brick));
    const int bit = voxelOffset(localOf(brick));
    if (block.test(bit)) return;
    block.set(bit);
    ++size_;
  }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Appends all bricks to a list, in any order.
  void appendTo(std::vector<Coord>& list) const {
    for (const auto& [place, block] : blocks_)
      for (int bit = 0; bit < kBrickVoxels; ++bit)
        if (block.test(bit)) list.push_back(place * kBrickSide + voxelLocal(bit));
  }

 private:
  struct HashOfBrick {
    std::size_t operator()(Coord brick) const { return std::size_t(hashOf(brick)); }
  };

  /// Bricks that follow each other mostly lie in the same block.
  BrickMask& blockAt(Coord place) {
    if (last_ == nullptr || place != lastPlace_) {
      last_ = &blocks_[place];  // stays where it is when others are added
      lastPlace_ = place;
    }
    return *last_;
  }

  std::unordered_map<Coord, BrickMask, HashOfBrick> blocks_;
  BrickMask* last_ = nullptr;
  Coord lastPlace_;
  std::uint64_t size_ = 0;
};

}  // namespace esvr
