#pragma once
/// Offsets of lists that lie one behind the other.

#include <cstdint>
#include <vector>

namespace esvr {

/// Turns the lengths of lists into the offsets at which they begin; the last element, whose length
/// is 0, becomes the sum. \throws RuntimeFailure  the sum has more than 32 bits
void makeOffsets(std::vector<std::uint32_t>& lengths);

}  // namespace esvr
