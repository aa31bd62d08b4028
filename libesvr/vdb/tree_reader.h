#pragma once
/// Reads the voxels of a .vdb archive with OpenVDB.

#include "esvr/vdb_io.h"
#include "vdb/archive.h"
#include "vdb/tree_survey.h"

namespace esvr::vdb {

/// True if the grid's tree can be fitted.
bool isScalarFloatTree(const ArchiveEntry& entry);

/// True if the components of the grid's tree can be fitted.
bool isVectorTree(const ArchiveEntry& entry);

/// True if readPackedVoxels can read the grid's tree.
bool isPackedTree(const ArchiveEntry& entry);

/// Surveys the tree of an entry for which isPackedTree is true.
/// \throws BadInput  the tree is truncated or damaged
TreeSurvey surveyTree(Archive& archive, const ArchiveEntry& entry);

/// The voxels of a grid, and its background in full precision.
struct TreeVoxels {
  SparseVolume volume;
  double background = 0.0;
  std::uint64_t nonFiniteReplaced = 0;
  InactiveValues inactive{};
};

/// What is read of a tree.
struct WantedVoxels {
  GridClass gridClass = GridClass::kUnknown;
  std::size_t component = 0;  ///< of vectors; 0 for other values
};

/// \throws BadInput  the tree is damaged or has no active voxel; voxels are not finite
/// \throws MemoryExceeded  it takes more than options.maxBytes
TreeVoxels readVoxels(Archive& archive, const ArchiveEntry& entry, const WantedVoxels& wanted,
                      const ReadOptions& options);

/// Reads the active voxels of an entry for which isPackedTree is true. Doubles of vectors are rounded to
/// floats; all other values are those of the file, also if they are not finite. Of a mask, the true
/// voxels among the active ones are read.
/// \throws BadInput  the tree is damaged
/// \throws MemoryExceeded  it takes more than options.maxBytes
AnyPackedVoxels readPackedVoxels(Archive& archive, const ArchiveEntry& entry,
                                 const ReadOptions& options);

}  // namespace esvr::vdb
