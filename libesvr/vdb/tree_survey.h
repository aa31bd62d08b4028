#pragma once
/// Surveys a grid's tree in a .vdb file without reading voxels. OpenVDB does not check sizes (a
/// negative chunk size makes it write beyond its buffers, a damaged Blosc header read beyond its
/// input), so it gets a tree only after this survey has checked all sizes. The survey also finds
/// what the tree holds.
///
/// The layout of a tree of 32^3, 16^3 and 8^3 nodes, in OpenVDB's format versions from 222 on:
///   1 (a buffer count), background, tile count, child count, tiles (coordinates, value, active),
///   children (coordinates, upper node);
///   a node: child mask, value mask, values (block), child nodes; a leaf: value mask;
///   then for each leaf: value mask, values (block).
///   A block: a byte that says how inactive values are stored, up to two of them, up to one mask,
///   the values, compressed as the grid's flags say.

#include <cstdint>

#include "esvr/coord.h"
#include "vdb/input_file.h"

namespace esvr::vdb {

/// The way in which a grid's values are stored in the file.
struct ValueLayout {
  std::uint64_t valueBytes = 4;   ///< size in memory: 4 for float, 8 for double, 12 for vec3s, ...
  std::uint64_t halfBytes = 2;    ///< size of a value as half: 2 for float, 6 for vec3s, ...
  bool savedAsHalf = false;       ///< in blocks, not in the background and the root's tiles
  std::uint32_t compression = 0;  ///< OpenVDB's flags
  /// True for truth values: a leaf then has its mask, its corner and a bit for each voxel, which are
  /// not compressed.
  bool leavesOfBits = false;
};

struct TreeSurvey {
  std::uint64_t leaves = 0;
  std::uint64_t activeVoxels = 0;  ///< including those of tiles
  std::uint64_t tileBricks = 0;    ///< number of 8^3 bricks that the active tiles cover
  Box activeBox;
};

/// Surveys the tree at the position of the file. \throws BadInput  it is truncated or damaged
TreeSurvey surveyTree(InputFile& file, const ValueLayout& layout);

}  // namespace esvr::vdb
