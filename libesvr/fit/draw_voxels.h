#pragma once
/// Draws voxels in proportion to their squared residual.

#include <cstdint>
#include <vector>

#include "fit/residual_field.h"

namespace esvr {

/// Which errors a new primitive can mend: one of positive intensity fills where V is too low.
struct SignsAllowed {
  bool positive = true, negative = false;
  [[nodiscard]] bool mends(float residual) const { return residual < 0.0f ? positive : negative; }
};

struct DrawOptions {
  std::size_t count = 0;
  std::size_t targetBricks = 0;  ///< voxels are drawn from the first so many bricks of the residual
  SignsAllowed signs{};
  std::uint64_t seed = 1;
};

/// Systematic sampling along the bricks' order: `count` equal shares of the total energy, one voxel
/// from each, so that draws spread evenly. Fewer, or none, where no residual can be mended.
[[nodiscard]] std::vector<Coord> drawVoxels(const ResidualField& residual,
                                            const DrawOptions& options);

}  // namespace esvr
