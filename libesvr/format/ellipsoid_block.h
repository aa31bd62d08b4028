#pragma once
/// One block of quantised ellipsoids as four streams of a range coder.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/quantised.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"
#include "format/chunk_box.h"

namespace esvr::format {

/// Blocks are decoded one without the other. Those of layers are smaller, so that a box needs fewer
/// ellipsoids; each block has to learn its models anew, which costs bytes (docs/lab-notes.md,
/// "Importance layers").
inline constexpr std::size_t kBlockEllipsoids = 4096, kLayerBlockEllipsoids = 2048;

inline constexpr std::size_t kStreams = 4;  ///< positions, scales, rotations, intensities
using BlockStreams = std::array<std::vector<std::byte>, kStreams>;
using BlockBytes = std::array<std::span<const std::byte>, kStreams>;

/// The ellipsoids of each block, layer by layer: without layers full blocks and a rest, in a layer
/// blocks as equal as can be.
[[nodiscard]] std::vector<Run> blockRuns(std::size_t count, std::span<const std::size_t> layerEnds);
[[nodiscard]] inline std::vector<Run> blockRuns(const QuantisedEllipsoids& q) {
  return blockRuns(q.size(), q.layerEnds);
}

/// Alike ellipsoids cost next to nothing, and a reader must know how many a byte can hold before it
/// allocates: writers add zeros where there would be more.
inline constexpr std::uint64_t kMaxEllipsoidsPerByte = 64;
void padForEllipsoids(ByteWriter& out, std::size_t count);

/// Refuses a section of `bytes` that says it has `stored` ellipsoids where its chunk has `count`,
/// or cannot hold them. \throws BadInput
void checkCount(const ByteReader& in, std::uint64_t stored, std::uint64_t count,
                std::uint64_t bytes);

/// Leaves `q` as it is.
[[nodiscard]] BlockStreams encodeBlock(QuantisedEllipsoids& q, Run run);

/// All of them.
[[nodiscard]] std::vector<BlockStreams> encodeBlocks(QuantisedEllipsoids q);

/// Fills a run of `q`, whose lattice and size are set. \throws BadInput  values outside the lattice
void decodeBlock(const BlockBytes& streams, Run run, QuantisedEllipsoids& q);

}  // namespace esvr::format
