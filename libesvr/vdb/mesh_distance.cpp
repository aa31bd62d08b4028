#include "esvr/vdb_io.h"

#include "vdb/open_vdb.h"

#include <openvdb/math/Proximity.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

#include "core/parallel.h"
#include "vdb/formats.h"
#include "vdb/properties.h"

namespace esvr::vdb {
namespace {

using openvdb::Vec3d;
using Range = tbb::blocked_range<std::size_t>;

/// Voxels around a mesh that know their nearest polygon.
constexpr float kIndexedWidth = 3.0f;

constexpr MeshDistance kApart{std::numeric_limits<double>::infinity(),
                              std::numeric_limits<double>::infinity()};

/// A mesh of quads in index space.
struct Mesh {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;

  [[nodiscard]] Vec3d corner(std::size_t quad, int k) const { return points[quads[quad][k]]; }
};

openvdb::math::Transform::Ptr identity() {
  return openvdb::math::Transform::createLinearTransform(1.0);
}

Mesh surfaceOf(const VolumeGrid& grid) {
  VolumeGrid floats{.descriptor = grid.descriptor, .volume = grid.volume};
  floats.descriptor.valueType = ValueType::kFloat;
  const auto made = makeOpenVdbGrid(floats, {.half = HalfMode::kOff, .constantTiles = false});
  made->setTransform(identity());
  Mesh mesh;
  openvdb::tools::volumeToMesh(*openvdb::gridConstPtrCast<openvdb::FloatGrid>(made), mesh.points,
                               mesh.quads, 0.0);
  return mesh;
}

/// A vertex and the point that was found for it.
struct Pair {
  Vec3d from, to;
  [[nodiscard]] double squared() const { return (from - to).lengthSqr(); }
};

/// Takes the point of a quad that is nearest to a vertex, if it is nearer than the point so far.
void approach(const Mesh& mesh, std::size_t quad, const Vec3d& from, std::optional<Pair>& nearest) {
  const Vec3d first = mesh.corner(quad, 0), third = mesh.corner(quad, 2);
  for (const int k : {1, 3}) {
    Vec3d weights;
    const Pair pair{from, openvdb::math::closestPointOnTriangleToPoint(first, mesh.corner(quad, k),
                                                                       third, from, weights)};
    if (!nearest || pair.squared() < nearest->squared()) nearest = pair;
  }
}

/// Finds the points of a mesh that are near vertices.
class NearestPoints {
 public:
  explicit NearestPoints(const Mesh& mesh) : mesh_(mesh) {
    const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec4I> adapter(
        mesh.points, mesh.quads);
    (void)openvdb::tools::meshToVolume<openvdb::FloatGrid>(
        adapter, *identity(), kIndexedWidth, kIndexedWidth, openvdb::tools::UNSIGNED_DISTANCE_FIELD,
        quads_.get());
  }

  /// The nearest point of the mesh; of a mesh far away, any point that is nearer than `enough`.
  [[nodiscard]] Pair find(const Vec3d& from, double enough) const {
    std::optional<Pair> nearest;
    const auto quads = quads_->getConstAccessor();
    const openvdb::Coord low = openvdb::Coord::floor(from);
    for (auto voxel = openvdb::CoordBBox(low.offsetBy(-1), low.offsetBy(2)).begin(); voxel; ++voxel)
      if (quads.isValueOn(*voxel))
        approach(mesh_, std::size_t(quads.getValue(*voxel)), from, nearest);
    for (std::size_t q = 0; !quads.isValueOn(low) && q < mesh_.quads.size(); ++q) {
      if (nearest && nearest->squared() <= enough) break;
      approach(mesh_, q, from, nearest);
    }
    return *nearest;
  }

 private:
  const Mesh& mesh_;
  openvdb::Int32Grid::Ptr quads_ = openvdb::Int32Grid::create(openvdb::util::INVALID_IDX);
};

MeshDistance larger(const MeshDistance& a, const MeshDistance& b) {
  return {std::max(a.voxels, b.voxels), std::max(a.world, b.world)};
}

/// The largest distance of a vertex of `from` to the mesh `to`.
MeshDistance directed(const Mesh& from, const Mesh& to, const openvdb::math::Transform& world) {
  const NearestPoints nearest(to);
  return parallelReduce(
      Range(0, from.points.size()), MeshDistance{},
      [&](const Range& range, MeshDistance found) {
        for (std::size_t p = range.begin(); p != range.end(); ++p) {
          const Pair pair = nearest.find(from.points[p], found.voxels * found.voxels);
          found = larger(found,
                         {(pair.from - pair.to).length(),
                          (world.indexToWorld(pair.from) - world.indexToWorld(pair.to)).length()});
        }
        return found;
      },
      larger);
}

}  // namespace
}  // namespace esvr::vdb

namespace esvr {

MeshDistance meshDistance(const VolumeGrid& reference, const VolumeGrid& candidate) {
  vdb::initializeOpenVdb();
  const vdb::Mesh a = vdb::surfaceOf(reference), b = vdb::surfaceOf(candidate);
  if (a.quads.empty() && b.quads.empty()) return {};
  if (a.quads.empty() || b.quads.empty()) return vdb::kApart;
  const auto world = vdb::toOpenVdb(reference.descriptor.transform);
  return vdb::larger(vdb::directed(a, b, *world), vdb::directed(b, a, *world));
}

}  // namespace esvr
