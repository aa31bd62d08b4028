#pragma once
/// The box that a chunk's record names, by which a reader decides whether it needs the chunk.

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"

namespace esvr::format {

/// Smallest integer box, in index coordinates, around every ellipsoid's support; cut off at the
/// ends of 32 bits. Empty without ellipsoids.
[[nodiscard]] Box supportBox(const Chunk& chunk, const Kernel& kernel);

/// Smallest integer box around every center: lies in the support box, and is the same on every
/// machine, so that it can be checked.
[[nodiscard]] Box centerBox(const Chunk& chunk);

}  // namespace esvr::format
