#pragma once
/// The records of a file that describe metadata, grids and chunks.

#include <cstdint>
#include <vector>

#include "esvr/container.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {

/// The record of a chunk, which is read before its ellipsoids.
struct ChunkRecord {
  Coord origin;
  Box box;  ///< index coordinates; contains every support
  std::uint64_t count = 0;
};

/// The record of a grid: everything but its bricks, curve and ellipsoids.
struct GridRecord {
  StoredGrid grid;  ///< its field has no chunks yet
  std::uint32_t chunkCount = 0;
  std::vector<ChunkRecord> chunks;  ///< a single chunk's record; empty if there are more
};

void putMetadata(ByteWriter& out, const std::vector<MetaItem>& items);
[[nodiscard]] std::vector<MetaItem> getMetadata(ByteReader& in);

void putChunk(ByteWriter& out, const ChunkRecord& chunk);
[[nodiscard]] ChunkRecord getChunk(ByteReader& in);

void putGrid(ByteWriter& out, const StoredGrid& grid, const std::vector<ChunkRecord>& chunks);
[[nodiscard]] GridRecord getGrid(ByteReader& in);

}  // namespace esvr::format
