#pragma once
/// The box in a chunk's record, by which a reader decides whether it needs the chunk.

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"

namespace esvr::format {

/// Consecutive ellipsoids of a chunk.
struct Run {
  std::size_t first = 0, count = 0;
};

[[nodiscard]] inline Run all(const Chunk& chunk) { return {0, chunk.ellipsoids.size()}; }

/// Smallest integer box, in index coordinates, that contains the supports of a run's ellipsoids. It
/// is limited to 32-bit coordinates. Empty without ellipsoids.
[[nodiscard]] Box supportBox(const Chunk& chunk, Run run, const Kernel& kernel);

/// Smallest integer box that contains the centers of a run's ellipsoids. It lies in the support box
/// and is the same on every machine, so that a reader can check the stored box against it.
[[nodiscard]] Box centerBox(const Chunk& chunk, Run run);

}  // namespace esvr::format
