#include "samples/volume_hash.h"

#include <bit>

#include "generators/hash_noise.h"

namespace esvr::test {
namespace {

class Hasher {
 public:
  void add(std::uint64_t word) { state_ = samples::hash(state_, word); }
  void add(Coord c) {
    add(std::uint32_t(c.x));
    add(std::uint32_t(c.y));
    add(std::uint32_t(c.z));
  }
  void add(float value) { add(std::bit_cast<std::uint32_t>(value)); }
  [[nodiscard]] std::uint64_t state() const { return state_; }

 private:
  void add(std::uint32_t word) { add(std::uint64_t{word}); }
  std::uint64_t state_ = 0;
};

}  // namespace

std::uint64_t hashOf(const SparseVolume& volume) {
  Hasher hasher;
  hasher.add(volume.origin);
  hasher.add(volume.background);
  for (const Coord brick : volume.bricks) hasher.add(brick);
  for (const float value : volume.values) hasher.add(value);
  for (const BrickMask& mask : volume.active)
    for (const std::uint64_t word : mask.words) hasher.add(word);
  return hasher.state();
}

}  // namespace esvr::test
