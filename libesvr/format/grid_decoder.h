#pragma once
/// Reads one grid of a file, or what a part needs of it.

#include <cstdint>
#include <span>

#include "esvr/container.h"
#include "format/grid_records.h"
#include "format/section_reader.h"

namespace esvr::format {

/// The file that grids are read from.
struct GridsOfFile {
  SectionReader& sections;
  GridRecords& records;
  const ReadPart* part = nullptr;  ///< the part to read; null: all of it
};

struct DecodedGrid {
  StoredGrid grid;
  std::uint64_t ellipsoidsInFile = 0;  ///< ellipsoids of the whole grid
};

/// \param before  the grids before this one
/// \throws BadInput  the grid is damaged
[[nodiscard]] DecodedGrid decodeGrid(const GridsOfFile& file, std::uint32_t grid,
                                     std::span<const StoredGrid> before);

/// Reads the record of a grid alone. \throws BadInput  the record is damaged
[[nodiscard]] DecodedGrid decodeGridRecord(const GridsOfFile& file, std::uint32_t grid);

}  // namespace esvr::format
