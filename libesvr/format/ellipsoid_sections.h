#pragma once
/// The sections of a chunk's ellipsoids: exact arrays of numbers, all quantised ellipsoids at once, or quantised
/// ellipsoids in importance layers, of which a reader decodes the blocks that it needs.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "esvr/quantised.h"
#include "format/bytes.h"
#include "format/ellipsoid_block.h"
#include "format/records.h"

namespace esvr::format {

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
