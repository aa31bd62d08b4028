#pragma once

#include <cstdint>

#include "esvr/sparse_volume.h"

namespace esvr::test {

/// A hash of everything in a volume: bricks, values bit by bit, active masks, origin and
/// background.
std::uint64_t hashOf(const SparseVolume& volume);

}  // namespace esvr::test
