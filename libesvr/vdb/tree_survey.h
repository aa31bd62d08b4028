#pragma once
/// A walk over a grid's tree in a .vdb file that reads no voxel. OpenVDB believes the sizes it
/// finds (a negative chunk size overruns its buffers, a damaged Blosc header its input), so nothing
/// is handed to it before this walk has checked it all. On the way it learns what the tree holds.
///
/// The layout, in OpenVDB's format versions 222 and up, of a tree of 32^3, 16^3 and 8^3 nodes:
///   1 (a buffer count), background, tile count, child count, tiles (coordinates, value, active),
///   children (coordinates, upper node);
///   a node: child mask, value mask, values (block), child nodes; a leaf: value mask;
///   then for each leaf: value mask, values (block).
///   A block: a byte that says how inactive values are kept, up to two of them, up to one mask,
///   the values, compressed as the grid's flags say.

#include <cstdint>

#include "esvr/coord.h"
#include "vdb/input_file.h"

namespace esvr::vdb {

/// How a grid's values lie in the file.
struct ValueLayout {
  std::uint64_t valueBytes = 4;   ///< in memory: 4 float, 8 double
  bool savedAsHalf = false;       ///< in blocks only; background and tiles of the root are whole
  std::uint32_t compression = 0;  ///< OpenVDB's flags
};

struct TreeSurvey {
  std::uint64_t leaves = 0;
  std::uint64_t activeVoxels = 0;  ///< those of tiles included
  std::uint64_t tileBricks = 0;    ///< 8^3 bricks that the active tiles amount to
  Box activeBox;
  std::uint64_t treeBytes = 0;  ///< that OpenVDB's tree takes in memory
};

/// Walks the tree at the file's position. \throws BadInput  truncated or damaged
TreeSurvey surveyTree(InputFile& file, const ValueLayout& layout);

}  // namespace esvr::vdb
