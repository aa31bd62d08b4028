#pragma once
/// The evaluation of a field on bricks. The ellipsoids of all chunks are gathered and prepared, listed by
/// bricks, and summed: on given bricks at once, in several calls, or in batches of bounded size.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/volume.h"
#include "field/brick_pairs.h"
#include "field/line_form.h"
#include "field/support.h"

namespace esvr {

/// The kappa of an ellipsoid of a field: its own one, or that of the field's kernel.
[[nodiscard]] inline double kappaOf(const Field& field, const Ellipsoids& e, std::size_t i) {
  return e.kappa.empty() ? double(field.kernel.kappa) : double(e.kappa[i]);
}

/// The ellipsoids of all chunks of a field, prepared for evaluation.
struct GatheredField {
  std::vector<BrickForm> forms;                 ///< centers relative to their chunk's origin
  std::vector<KernelConstants<float>> kernels;  ///< one for all, or one for each ellipsoid
  std::vector<Coord> origins;                   ///< origins of the chunks
  std::vector<std::uint32_t> chunkOf;           ///< chunk of each ellipsoid

  [[nodiscard]] const KernelConstants<float>& kernel(std::size_t i) const {
    return kernels[kernels.size() == 1 ? 0 : i];
  }
  /// Position of a voxel relative to the origin of ellipsoid i's chunk. The difference of two
  /// 32-bit coordinates may have 33 bits.
  [[nodiscard]] std::array<float, 3> fromOrigin(std::size_t i, Coord voxel) const {
    const Coord o = origins[chunkOf[i]];
    return {float(double(voxel.x) - o.x), float(double(voxel.y) - o.y),
            float(double(voxel.z) - o.z)};
  }
};

[[nodiscard]] GatheredField gather(const Field& field);

/// Voxels by which supports are widened. The rounding of centers and forms to float32 is far
/// smaller.
inline constexpr double kRoundingSlack = 0.02;

/// The supports of all ellipsoids in index coordinates, widened by `slack` voxels.
[[nodiscard]] std::vector<Support> supports(const Field& field, double slack = kRoundingSlack);

/// The data that the evaluation of a field on bricks needs on any device.
struct EvaluatePlan {
  GatheredField field;
  BrickPairs pairs;  ///< pairs with the bricks, which are in the order of the corners
};

/// \param corners  index corners of the bricks, multiples of 8
[[nodiscard]] EvaluatePlan planEvaluation(const Field& field, std::span<const Coord> corners);

/// A field that is prepared for evaluation on any bricks.
struct PreparedField {
  explicit PreparedField(const Field& field)
      : gathered(gather(field)), reach(supports(field)), background(field.background) {}

  GatheredField gathered;
  std::vector<Support> reach;  ///< supports of the ellipsoids
  float background;
};

/// Evaluates a field on bricks in several calls. The pair lists are built once for all of them.
class BrickEvaluator {
 public:
  /// \param field    must outlive the evaluator
  /// \param corners  index corners of the bricks; must outlive the evaluator
  BrickEvaluator(const PreparedField& field, std::span<const Coord> corners)
      : field_(field), corners_(corners), pairs_(pairsWith(field.reach, corners)) {}

  /// Evaluates V on the bricks first, first + 1, ..., in parallel.
  /// \param out  kBrickVoxels values for each brick; its size decides how many bricks are evaluated
  void evaluate(std::size_t first, std::span<float> out) const;

 private:
  const PreparedField& field_;
  std::span<const Coord> corners_;
  BrickPairs pairs_;
};

/// Largest number of bricks that are evaluated at once. Their values take 32 MB.
inline constexpr std::size_t kBatchBricks = 16384;

/// Largest number of pairs of an ellipsoid and a brick that are listed at once, unless a single
/// brick has more. Their lists take 0.4 GB.
inline constexpr double kMaxListedPairs = 0x1p25;

/// Some bricks and their values.
struct BrickBatch {
  std::span<const Coord> corners;  ///< index corners
  std::span<float> all;  ///< kBrickVoxels values for each brick; a visitor may change them

  [[nodiscard]] std::size_t size() const { return corners.size(); }
  [[nodiscard]] std::span<float> values(std::size_t b) const {
    return all.subspan(b * kBrickVoxels, kBrickVoxels);
  }
};
using BatchVisitor = std::function<void(const BrickBatch&)>;

/// Calls `visit` for all bricks, in order and at most kBatchBricks at a time, from the calling
/// thread.
/// \param maxListed  see kMaxListedPairs
void forEachBatch(const Field& field, std::span<const Coord> corners, const BatchVisitor& visit,
                  double maxListed = kMaxListedPairs);

}  // namespace esvr
