#include "field/offsets.h"

#include <limits>
#include <string>

#include "esvr/error.h"

namespace esvr {

void makeOffsets(std::vector<std::uint32_t>& lengths) {
  constexpr std::uint64_t kMax = std::numeric_limits<std::uint32_t>::max();
  std::uint64_t sum = 0;
  for (std::uint32_t& length : lengths) {
    const std::uint64_t begin = sum;
    sum += length;
    length = std::uint32_t(begin);
  }
  if (sum > kMax)
    throw RuntimeFailure("there are " + std::to_string(sum) +
                         " pairs of an ellipsoid and a brick, more than the " +
                         std::to_string(kMax) + " that lists hold");
}

}  // namespace esvr
