#pragma once
/// Sections of a chunk's ellipsoids: exact arrays of numbers, all quantised ellipsoids at once, or quantised ellipsoids in
/// importance layers, of which a reader decodes the blocks that it needs. They are made of boxes, by which a reader decides
/// what it needs, the quantisation lattice, and blocks as four streams of the range coder.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/quantised.h"
#include "esvr/volume.h"
#include "format/bytes.h"
#include "format/records.h"

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

// ---- Exact ellipsoids: one array after the other

using Plane = std::vector<float>;

[[nodiscard]] std::vector<std::byte> putPlanes(std::span<const Plane> planes);

/// Fills each of `planes` with `count` values.
/// \throws BadInput  the content has another size, which is checked before memory is allocated; the
///                   text begins with `where`
void getPlanes(std::span<const std::byte> content, std::uint64_t count, std::span<Plane> planes,
               const std::string& where);

/// True if every quaternion is (1, 0, 0, 0), bit by bit; the section of rotations is then left out.
[[nodiscard]] bool allIdentity(const std::array<Plane, 4>& rotation);
void setIdentity(std::array<Plane, 4>& rotation, std::size_t count);

// ---- Quantised ellipsoids: quantisation lattice, block table, streams

/// \param q  ellipsoids without layers
[[nodiscard]] std::vector<std::byte> putEllipsoids(const QuantisedEllipsoids& q);

/// \param count  number of ellipsoids in the chunk's record, which is compared with the content
///               before memory is allocated
/// \throws BadInput  the content is damaged; the text begins with `where`
[[nodiscard]] QuantisedEllipsoids getEllipsoids(std::span<const std::byte> content,
                                                std::uint64_t count, const std::string& where);

// ---- Importance layers: a directory with the box of each block, and then the blocks, layer by layer

struct BlockEntry {
  Run run;
  std::size_t layer = 0;
  Box box;  ///< index coordinates; contains the block's supports, lies in the chunk's box
  std::array<std::uint32_t, kStreams> bytes{};  ///< lengths of its streams
  std::uint64_t offset = 0;                     ///< position in the section
  std::uint64_t checksum = 0;

  [[nodiscard]] std::uint64_t size() const;
};

struct BlockDirectory {
  Lattice lattice;
  std::vector<std::size_t> layerEnds;
  std::vector<BlockEntry> blocks;
};

/// \param chunk  box of the chunk
/// \param boxes  boxes of the supports of blockRuns(q)
[[nodiscard]] std::vector<std::byte> putLayered(const QuantisedEllipsoids& q, const Box& chunk,
                                                std::span<const Box> boxes);

/// Bytes of a chunk's section of ellipsoids, with or without layers.
[[nodiscard]] std::uint64_t storedBytes(const QuantisedEllipsoids& q);

/// \param section  section whose name begins error texts
/// \throws BadInput  the directory is damaged, or is not that of the chunk
[[nodiscard]] BlockDirectory getDirectory(const ByteSource& section, const ChunkRecord& chunk);

/// Decodes the chosen blocks.
/// \param chosen  increasing positions in the directory
/// \return the ellipsoids of these blocks; layers without a chosen block are left out
/// \throws BadInput  a block is damaged
[[nodiscard]] QuantisedEllipsoids getBlocks(const ByteSource& section,
                                            const BlockDirectory& directory,
                                            std::span<const std::size_t> chosen);

/// Refuses bytes after the last block that are not zero. \throws BadInput
void checkEnd(const ByteSource& section, const BlockDirectory& directory);

}  // namespace esvr::format
