#pragma once
/// Soft-edged tubes, which look like vessels and neurons in a scan; and a tree of them.
/// Neuron skeletons in SWC: a line "id type x y z radius parent" for each node; '#' begins a
/// comment (Cannon et al. 1998;
/// http://www.neuronland.org/NLMorphologyConverter/MorphologyFormats/SWC)

#include <algorithm>
#include <cstdint>
#include <istream>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/volume.h"
#include "generators/voxelise.h"

namespace esvr::samples {

/// A round cone in index coordinates: the union of balls whose centre moves from a to b while the
/// radius changes from radiusA to radiusB.
struct Tube {
  Vec3 a, b;
  double radiusA = 0.0, radiusB = 0.0;
};

/// The exact distance of a point to the surface, negative inside.
[[nodiscard]] double signedDistance(const Tube& tube, Vec3 p);

/// 1 for distance <= -edge / 2, 0 for distance >= edge / 2, and smooth between.
/// \param distance  distance to the surface, negative inside
inline float softEdge(double distance, double edge) {
  const double t = std::clamp(0.5 - distance / edge, 0.0, 1.0);
  return float(t * t * (3.0 - 2.0 * t));
}

/// The union of tubes: 1 inside, with a soft edge of `edge` voxels to 0 outside.
class TubeShape {
 public:
  /// \param tubes  tubes that outlive all shapes narrowed from this one
  TubeShape(std::span<const Tube> tubes, double edge);

  [[nodiscard]] std::optional<TubeShape> within(const Ball& ball) const;
  [[nodiscard]] Sample at(Vec3 p) const;

 private:
  TubeShape(std::span<const Tube> tubes, double edge, std::vector<std::uint32_t> near)
      : tubes_(tubes), edge_(edge), near_(std::move(near)) {}

  std::span<const Tube> tubes_;
  double edge_;
  std::vector<std::uint32_t> near_;  ///< the tubes that reach where this shape is used
};

/// The box of voxels that the tubes and their edges reach. \param tubes  at least one tube
[[nodiscard]] Box boundsOf(std::span<const Tube> tubes, double edge);

inline constexpr double kDefaultEdge = 2.0;  ///< width of a soft edge, voxels

/// Makes a volume with background 0, in which voxels above 0 are active.
[[nodiscard]] SparseVolume voxeliseTubes(std::span<const Tube> tubes, double edge,
                                         const Limits& limits);

/// How tubes are scaled from their own units to voxels.
struct TubeScale {
  int resolution = 128;     ///< voxels along the longest side of the tubes' box
  double minRadius = 0.75;  ///< voxels: thinner tubes are thickened to it
  int margin = 1;           ///< voxels kept free for soft edges below the smallest corner
};

struct ScaledTubes {
  std::vector<Tube> tubes;  ///< index coordinates, smallest corner at `margin`
  double voxelSize = 1.0;   ///< side of a voxel in the units of the tubes
  Vec3 origin;              ///< position of index (0, 0, 0) in the units of the tubes
};

/// \throws BadInput  the tubes have no extent
[[nodiscard]] ScaledTubes fitTubes(std::span<const Tube> tubes, const TubeScale& scale);

/// The smallest radius of a tube in voxels; thinner tubes would have gaps.
inline constexpr double kThinnestTube = 0.75;

/// The tubes of branching vessels, whose longest side is `resolution` voxels. The tree is the same
/// for every resolution, except that no tube is thinner than kThinnestTube.
[[nodiscard]] std::vector<Tube> treeTubes(const SampleOptions& options);

[[nodiscard]] SparseVolume makeTree(const SampleOptions& options);

// ---- Skeletons

struct SkeletonNode {
  Vec3 position;                      ///< the file's units
  double radius = 0.0;                ///< the file's units; may be 0
  std::optional<std::size_t> parent;  ///< index into the nodes; nothing for a root
};

using Skeleton = std::vector<SkeletonNode>;

/// Reads a skeleton.
/// \param name  name of the source for messages
/// \throws BadInput  there is no node; a line is not a node (the text gives its number); an id is
///                   defined twice; a parent does not exist or is the node itself
[[nodiscard]] Skeleton parseSwc(std::istream& text, const std::string& name);

/// Makes a round cone from every node to its parent, and a ball for each node without links, in the
/// file's units.
[[nodiscard]] std::vector<Tube> tubesOf(const Skeleton& skeleton);

/// Keeps the `count` connected pieces of a skeleton that have the longest cable.
[[nodiscard]] Skeleton longestPieces(const Skeleton& skeleton, std::size_t count);

}  // namespace esvr::samples
