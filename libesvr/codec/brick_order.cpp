#include "codec/brick_order.h"

#include <algorithm>
#include <numeric>

#include "codec/morton.h"

namespace esvr::codec {

std::uint64_t keyOf(Coord brick) {
  return spreadBits(std::uint64_t(brick.x)) | spreadBits(std::uint64_t(brick.y)) << 1 |
         spreadBits(std::uint64_t(brick.z)) << 2;
}

Coord brickAt(std::uint64_t key) {
  return {std::int32_t(gatherBits(key)), std::int32_t(gatherBits(key >> 1)),
          std::int32_t(gatherBits(key >> 2))};
}

std::vector<std::size_t> codingOrder(const std::vector<Coord>& bricks) {
  std::vector<std::size_t> order(bricks.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return keyOf(bricks[a]) < keyOf(bricks[b]); });
  return order;
}

}  // namespace esvr::codec
