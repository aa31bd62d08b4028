#pragma once
/// Parts of the sections of ellipsoids: the boxes by which a reader decides what it needs, the quantisation lattice, and
/// blocks of quantised ellipsoids as four streams of the range coder.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/quantised.h"
#include "esvr/volume.h"
#include "format/bytes.h"

namespace esvr::format {

// ---- Boxes

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

// ---- The lattice

void putLattice(ByteWriter& out, const Lattice& lattice);

/// \throws BadInput  a step is not positive, or a number of bits is out of range
[[nodiscard]] Lattice getLattice(ByteReader& in);

// ---- Blocks

/// Blocks are decoded one without the other. Those of layers are smaller, so that a box needs fewer
/// ellipsoids; each block has to learn its models anew, which costs bytes (docs/lab-notes.md,
/// "Importance layers").
inline constexpr std::size_t kBlockEllipsoids = 4096, kLayerBlockEllipsoids = 2048;

inline constexpr std::size_t kStreams = 4;  ///< positions, scales, rotations, intensities
using BlockStreams = std::array<std::vector<std::byte>, kStreams>;
using BlockBytes = std::array<std::span<const std::byte>, kStreams>;

/// The ellipsoids of each block, layer by layer. Without layers all blocks but the last are full.
/// The blocks of a layer are of equal size, to within one ellipsoid.
[[nodiscard]] std::vector<Run> blockRuns(std::size_t count, std::span<const std::size_t> layerEnds);
[[nodiscard]] inline std::vector<Run> blockRuns(const QuantisedEllipsoids& q) {
  return blockRuns(q.size(), q.layerEnds);
}

/// Bytes that a quantised ellipsoid takes in memory, as integers and as floats.
inline constexpr double kDecodedBytesPerEllipsoid = 128.0;

/// Limit on the number of ellipsoids in a byte, so that a reader knows it before it allocates
/// memory. Equal ellipsoids could take fewer bytes; the writer then adds zeros.
inline constexpr std::uint64_t kMaxEllipsoidsPerByte = 64;
void padForEllipsoids(ByteWriter& out, std::size_t count);

/// Refuses a section of `bytes` whose number of ellipsoids, `stored`, is not its chunk's `count` or
/// cannot be in so few bytes. \throws BadInput
void checkCount(const ByteReader& in, std::uint64_t stored, std::uint64_t count,
                std::uint64_t bytes);

/// Encodes a run of `q`, which does not change.
[[nodiscard]] BlockStreams encodeBlock(QuantisedEllipsoids& q, Run run);

/// Encodes all blocks.
[[nodiscard]] std::vector<BlockStreams> encodeBlocks(QuantisedEllipsoids q);

/// Decodes a run of `q`, whose lattice and size are set.
/// \throws BadInput  values are outside the quantisation lattice
void decodeBlock(const BlockBytes& streams, Run run, QuantisedEllipsoids& q);

}  // namespace esvr::format
