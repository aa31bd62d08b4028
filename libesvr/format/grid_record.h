#pragma once
/// The records of a file that describe: metadata, grids, chunks.

#include <cstdint>
#include <vector>

#include "esvr/container.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {

/// The description of a chunk, which is read before its ellipsoids.
struct ChunkRecord {
  Coord origin;
  Box box;  ///< index coordinates: every support lies in it
  std::uint64_t count = 0;
};

/// A grid without leaves, curve and ellipsoids.
struct GridRecord {
  StoredGrid grid;  ///< its field has no chunks yet
  std::uint32_t chunkCount = 0;
  std::vector<ChunkRecord> chunks;  ///< the one chunk; none where there is a chunk table
};

void putMetadata(ByteWriter& out, const std::vector<MetaItem>& items);
[[nodiscard]] std::vector<MetaItem> getMetadata(ByteReader& in);

void putChunk(ByteWriter& out, const ChunkRecord& chunk);
[[nodiscard]] ChunkRecord getChunk(ByteReader& in);

void putGrid(ByteWriter& out, const StoredGrid& grid, const std::vector<ChunkRecord>& chunks);
[[nodiscard]] GridRecord getGrid(ByteReader& in);

}  // namespace esvr::format
