#pragma once
/// A chunk's quantised ellipsoids in importance layers as the content of a section: a directory
/// that tells which block reaches where, then the blocks, layer by layer. A reader takes what it
/// needs.

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
  Box box;  ///< index coordinates: every support of the block lies in it, and it in the chunk's
  std::array<std::uint32_t, kStreams> bytes{};  ///< lengths of its streams
  std::uint64_t offset = 0;                     ///< in the section
  std::uint64_t checksum = 0;

  [[nodiscard]] std::uint64_t size() const;
};

struct BlockDirectory {
  Lattice lattice;
  std::vector<std::size_t> layerEnds;
  std::vector<BlockEntry> blocks;
};

/// \param chunk  box of the chunk \param boxes  of the supports of blockRuns(q)
[[nodiscard]] std::vector<std::byte> putLayered(const QuantisedEllipsoids& q, const Box& chunk,
                                                std::span<const Box> boxes);

/// Bytes of the section that a chunk's ellipsoids make, in layers or not.
[[nodiscard]] std::uint64_t storedBytes(const QuantisedEllipsoids& q);

/// \param section  its name begins errors \throws BadInput  damaged; not of that chunk
[[nodiscard]] BlockDirectory getDirectory(const ByteSource& section, const ChunkRecord& chunk);

/// Reads some of the blocks. \param chosen  increasing positions in the directory
/// \return  of these alone: layers that none of them is of are left out \throws BadInput
[[nodiscard]] QuantisedEllipsoids getBlocks(const ByteSource& section,
                                            const BlockDirectory& directory,
                                            std::span<const std::size_t> chosen);

/// Refuses bytes behind the last block that are not zero. \throws BadInput
void checkEnd(const ByteSource& section, const BlockDirectory& directory);

}  // namespace esvr::format
