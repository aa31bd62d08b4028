#pragma once
/// One block of quantised ellipsoids as four streams of a range coder.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/quantised.h"

namespace esvr::format {

/// Blocks are decoded one without the other.
inline constexpr std::size_t kBlockEllipsoids = 4096;

inline constexpr std::size_t kStreams = 4;  ///< positions, scales, rotations, intensities
using BlockStreams = std::array<std::vector<std::byte>, kStreams>;
using BlockBytes = std::array<std::span<const std::byte>, kStreams>;

/// A run of ellipsoids.
struct Run {
  std::size_t first = 0, count = 0;
};

/// Leaves `q` as it is.
[[nodiscard]] BlockStreams encodeBlock(QuantisedEllipsoids& q, Run run);

/// Fills a run of `q`, whose lattice and size are set. \throws BadInput  values outside the lattice
void decodeBlock(const BlockBytes& streams, Run run, QuantisedEllipsoids& q);

}  // namespace esvr::format
