#pragma once
/// The quantised ellipsoids of a chunk in importance layers, as the content of a section: a
/// directory with the box of each block, and then the blocks, layer by layer. A reader decodes the
/// blocks that it needs.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/quantised.h"
#include "format/byte_source.h"
#include "format/ellipsoid_block.h"
#include "format/grid_record.h"

namespace esvr::format {

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
