#pragma once
/// The distance between the surfaces of two level sets.

#include "esvr/vdb_io.h"

namespace esvr {

/// A Hausdorff distance of two meshes, over their vertices.
struct MeshDistance {
  double voxels = 0.0;  ///< in voxels (index space)
  double world = 0.0;   ///< largest distance of the same pairs of points, in units of the world
};

/// Makes a mesh of each level set's zero crossing with openvdb::tools::volumeToMesh, at isovalue 0
/// and without adaptivity. For every vertex of either mesh, the nearest point of the other mesh is
/// sought; the result is the largest distance of such a pair, in both directions. The points are
/// sought on the polygons that are nearest to the 64 voxels around the vertex, so that the distance
/// is never too small; if these voxels are farther than 3 voxels from the mesh, on all polygons. Pairs are sought in index space. Their distance in the world is that after the
/// transform of the reference.
/// \return infinity if only one of the grids has a surface, and 0 if none has
[[nodiscard]] MeshDistance meshDistance(const VolumeGrid& reference, const VolumeGrid& candidate);

}  // namespace esvr
