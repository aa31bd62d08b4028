#pragma once
/// OpenVDB's grids of all types whose voxels are read or written here, and what differs between OpenVDB
/// 10 and 13. Source files of this folder include this header before any other one of OpenVDB.
///
/// OpenVDB 13 has no delayed loading. This library does not use it: grids are read from a stream of
/// its own (archive.h), which OpenVDB cannot map into memory, so all voxels are loaded when a read
/// returns.

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cstdint>

#if OPENVDB_LIBRARY_MAJOR_VERSION_NUMBER < 10
#error "ESVR needs OpenVDB 10 or newer"
#endif

// Every source file that uses these types would compile all virtual functions of their trees. libopenvdb or open_vdb.cpp
// has them.
extern template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::DoubleTree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Vec3STree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Vec3DTree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Int32Tree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Int64Tree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::BoolTree::RootNodeType>;
extern template class openvdb::Grid<openvdb::FloatTree>;
extern template class openvdb::Grid<openvdb::DoubleTree>;
extern template class openvdb::Grid<openvdb::Vec3STree>;
extern template class openvdb::Grid<openvdb::Vec3DTree>;
extern template class openvdb::Grid<openvdb::Int32Tree>;
extern template class openvdb::Grid<openvdb::Int64Tree>;
extern template class openvdb::Grid<openvdb::BoolTree>;

namespace esvr::vdb {

/// The tree of the type HalfGrid, which OpenVDB 13 has and older versions do not name. Files store its values
/// as they do those of other types that half floats do not change, so that every version can read them.
using HalfTree = openvdb::tree::Tree4<openvdb::math::half, 5, 4, 3>::Type;

/// Registers OpenVDB's types. It is cheap after the first call and safe to call from any thread.
void initializeOpenVdb();

/// The oldest file format that can be read, that of OpenVDB 1.1 (2013), the first with masks for
/// each node.
inline constexpr std::uint32_t kOldestFileVersion =
    openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION;

/// The newest file format whose bytes are known. Format 225 of OpenVDB 13 has one more type of grids
/// than format 224, and stores all others in the same way, so that older versions of OpenVDB can read
/// and write their bytes.
inline constexpr std::uint32_t kNewestFileVersion =
    std::max<std::uint32_t>(225, openvdb::OPENVDB_FILE_VERSION);

}  // namespace esvr::vdb
