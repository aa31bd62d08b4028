#pragma once
/// The box that a chunk's record names, by which a reader decides whether it needs the chunk.

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"

namespace esvr::format {

/// A run of a chunk's ellipsoids.
struct Run {
  std::size_t first = 0, count = 0;
};

[[nodiscard]] inline Run all(const Chunk& chunk) { return {0, chunk.ellipsoids.size()}; }

/// Smallest integer box, in index coordinates, around the support of every ellipsoid of a run; cut
/// off at the ends of 32 bits. Empty without ellipsoids.
[[nodiscard]] Box supportBox(const Chunk& chunk, Run run, const Kernel& kernel);

/// Smallest integer box around every center: lies in the support box, and is the same on every
/// machine, so that it can be checked.
[[nodiscard]] Box centerBox(const Chunk& chunk, Run run);

}  // namespace esvr::format
