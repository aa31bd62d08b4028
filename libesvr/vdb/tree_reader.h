#pragma once
/// Voxels from a .vdb archive, by OpenVDB.

#include "esvr/vdb_io.h"
#include "vdb/archive.h"
#include "vdb/tree_survey.h"

namespace esvr::vdb {

/// True where the grid's tree is one that can be fitted.
bool isScalarFloatTree(const ArchiveEntry& entry);

/// Walks the tree of an entry whose isScalarFloatTree. \throws BadInput
TreeSurvey surveyTree(Archive& archive, const ArchiveEntry& entry);

/// A grid's voxels, and its background in full precision.
struct TreeVoxels {
  SparseVolume volume;
  double background = 0.0;
  std::uint64_t nonFiniteReplaced = 0;
};

/// \throws BadInput  damaged; no active voxel; non-finite voxels; more than options.maxBytes
TreeVoxels readVoxels(Archive& archive, const ArchiveEntry& entry, GridClass gridClass,
                      const ReadOptions& options);

}  // namespace esvr::vdb
