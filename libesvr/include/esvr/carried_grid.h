#pragma once
/// A grid that is not converted but carried: the bytes that OpenVDB wrote for it, which come back
/// bit for bit. Any type of grid can be carried, also one that OpenVDB does not know.

#include <cstddef>
#include <cstdint>
#include <string>

#include "esvr/voxel_memory.h"

namespace esvr {

struct CarriedGrid {
  std::string name;          ///< name in the grid's own metadata; not necessarily unique
  std::string treeType;      ///< OpenVDB's name: "Tree_vec3s_5_4_3", "Tree_ptdataidx32_5_4_3", ...
  bool savedAsHalf = false;  ///< whether the .vdb file says that its values are half floats
  std::uint32_t vdbVersion = 0;  ///< version of the VDB format that the bytes have: 222 to 224, ...
  /// Number of grids before this one in the file that has it. The grids of a file are in the order
  /// of their places, and those that are not carried take the places that are left.
  std::uint32_t place = 0;
  /// Position in `bytes` where the values of the tree begin, as the .vdb file says.
  std::uint64_t blocksAt = 0;
  /// The grid as in a .vdb file: flags of the compression, metadata, transform and tree. A grid
  /// that shares the tree of another grid has a copy of it.
  VoxelArray<std::byte> bytes;

  friend bool operator==(const CarriedGrid&, const CarriedGrid&) = default;
};

}  // namespace esvr
