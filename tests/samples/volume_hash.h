#pragma once

#include <cstdint>

#include "esvr/sparse_volume.h"

namespace esvr::test {

/// A hash of all that a volume holds: bricks, values to the bit, activity, origin, background.
std::uint64_t hashOf(const SparseVolume& volume);

}  // namespace esvr::test
