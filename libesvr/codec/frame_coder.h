#pragma once
/// Codes the voxels of a frame with the voxels of the previous frame as context (docs/format.md, "Frames"). A brick may be a
/// copy of the previous frame at a motion. In all other bricks, each voxel is predicted from the voxels before it and from the
/// previous frame around it, by weights that follow from least squares.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "codec/range_coder.h"
#include "core/brick_index.h"
#include "esvr/quantised.h"
#include "esvr/volume.h"

namespace esvr::codec {

/// All results are computed in float64 with +, -, *, / and square roots in a fixed order, so that
/// every machine gets the same bits. The file that includes this header must be compiled without
/// contraction to fused operations.
/// \tparam kCount  number of terms of a sum
template <std::size_t kCount>
class LeastSquares {
 public:
  using Terms = std::array<double, kCount>;

  /// \param first  weights before anything was learned
  explicit LeastSquares(const Terms& first) : weights_(first) {
    for (std::size_t i = 0; i < kCount; ++i) {
      products_[i][i] = kRidge;
      targets_[i] = kRidge * first[i];
    }
  }

  [[nodiscard]] double predict(const Terms& terms) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < kCount; ++i) sum += weights_[i] * terms[i];
    return sum;
  }

  void learn(const Terms& terms, double target) {
    for (std::size_t i = 0; i < kCount; ++i) {
      for (std::size_t j = 0; j <= i; ++j) products_[i][j] += terms[i] * terms[j];
      targets_[i] += terms[i] * target;
    }
  }

  /// Computes the weights by a Cholesky decomposition. They stay as they are if the products are
  /// singular or not finite.
  void solve() {
    std::array<Terms, kCount> lower{};
    for (std::size_t i = 0; i < kCount; ++i) {
      for (std::size_t j = 0; j < i; ++j) lower[i][j] = rest(lower, i, j) / lower[j][j];
      const double pivot = rest(lower, i, i);
      if (!(pivot > kLeastPivot * products_[i][i] && std::isfinite(pivot))) return;
      lower[i][i] = std::sqrt(pivot);
    }
    substitute(lower);
  }

  /// Makes what was learned so far count less.
  void fade() {
    for (std::size_t i = 0; i < kCount; ++i) {
      for (double& product : products_[i]) product *= kFade;
      targets_[i] *= kFade;
    }
  }

 private:
  static constexpr double kRidge = 1.0;  // weight of the first weights, in squared codes
  static constexpr double kFade = 0.98;
  static constexpr double kLeastPivot = 1e-12;

  [[nodiscard]] double rest(const std::array<Terms, kCount>& lower, std::size_t i,
                            std::size_t j) const {
    double sum = products_[i][j];
    for (std::size_t k = 0; k < j; ++k) sum -= lower[i][k] * lower[j][k];
    return sum;
  }

  void substitute(const std::array<Terms, kCount>& lower) {
    Terms half{};
    for (std::size_t i = 0; i < kCount; ++i) {
      double sum = targets_[i];
      for (std::size_t k = 0; k < i; ++k) sum -= lower[i][k] * half[k];
      half[i] = sum / lower[i][i];
    }
    for (std::size_t i = kCount; i-- > 0;) {
      double sum = half[i];
      for (std::size_t k = i + 1; k < kCount; ++k) sum -= lower[k][i] * weights_[k];
      weights_[i] = sum / lower[i][i];
    }
  }

  std::array<Terms, kCount> products_{};  // symmetric; only the lower half is kept
  Terms targets_{}, weights_;
};

// ---- The previous frame

/// A cube of voxels of the previous frame around a brick.
template <int kMargin>
struct PastCube {
  static constexpr int kSide = kBrickSide + 2 * kMargin;
  static constexpr int kStepX = kSide * kSide, kStepY = kSide, kStepZ = 1;
  static constexpr std::size_t kCells = std::size_t(kSide) * kSide * kSide;

  std::array<double, kCells> place;  ///< values in units of the codes
  std::array<bool, kCells> active;

  static std::size_t cell(Coord local) {
    return std::size_t((local.x + kMargin) * kStepX + (local.y + kMargin) * kStepY + local.z +
                       kMargin);
  }
};

/// True if the origins are near enough to each other for `now` to be predicted from `past`, and
/// vacant voxels of `now` have the code of the background.
[[nodiscard]] bool isPredictable(const VoxelLayer& now, const VoxelLayer& past);

/// The value gain * v + offset in place of v. The default changes nothing.
struct ValueMap {
  double gain = 1.0, offset = 0.0;
  friend bool operator==(const ValueMap&, const ValueMap&) = default;
};

class PastVoxels {
 public:
  /// \param past  the layer of the previous frame, which must outlive this object
  /// \param now   the frame that is coded: its form, divisor, palette, background and origin
  /// \param map   of the values of `past`
  PastVoxels(const VoxelLayer& past, const VoxelLayer& now, const ValueMap& map = {});

  [[nodiscard]] const VoxelLayer& layer() const { return past_; }
  /// Position of the bricks of the previous frame relative to the origin of the frame.
  [[nodiscard]] Coord brickAt(std::size_t b) const { return past_.bricks[b] + shift_; }
  /// The brick of the previous frame at a position relative to the origin of the frame, or
  /// BrickIndex::kNone.
  [[nodiscard]] std::uint32_t find(Coord brick) const { return index_.find(brick - shift_); }

  /// Copies the cube around the brick at `brick`, whose voxels are taken from places that are
  /// `motion` lower.
  template <int kMargin>
  void fill(Coord brick, Coord motion, PastCube<kMargin>& cube) const {
    const Coord first = brick * kBrickSide - motion;
    for (int x = -kMargin; x < kBrickSide + kMargin; ++x)
      for (int y = -kMargin; y < kBrickSide + kMargin; ++y) {
        const std::size_t cell = PastCube<kMargin>::cell({x, y, -kMargin});
        fillLine(first + Coord{x, y, -kMargin}, PastCube<kMargin>::kSide, &cube.place[cell],
                 &cube.active[cell]);
      }
  }

 private:
  void fillLine(Coord voxel, int count, double* place, bool* active) const;

  const VoxelLayer& past_;
  BrickIndex index_;
  Coord shift_;                ///< this is added to places in the previous frame, in bricks
  double vacantPlace_ = 0.0;   ///< place of voxels that are vacant or have no brick
  VoxelArray<double> places_;  ///< places of all voxels of the previous frame
};

// ---- Motion

/// Largest motion of a brick along an axis, in voxels.
inline constexpr int kLargestMotion = 4;

/// Finds the motion of a brick since the previous frame.
class MotionSearch {
 public:
  explicit MotionSearch(const PastVoxels& past)
      : past_(past), cube_(std::make_unique<PastCube<kLargestMotion>>()) {}

  /// The motion found from which the previous frame differs least from a brick. The search descends
  /// from no motion and from `expected`, which is taken unless another one is clearly better.
  [[nodiscard]] Coord find(Coord brick, std::span<const std::int32_t> codes, Coord expected);

 private:
  [[nodiscard]] double costOf(Coord motion, std::span<const std::int32_t> codes,
                              Coord expected) const;

  const PastVoxels& past_;
  std::unique_ptr<PastCube<kLargestMotion>> cube_;
};

// ---- The coder

/// What chooseFrameCodes() weighs.
struct FrameThrift {
  std::vector<double> exact;  ///< the voxels in units of the lattice, as the layer's codes
  double bitPrice = 0.0;      ///< squared error, in the same units, that a bit is worth
  double steadiness = 0.0;    ///< share of the previous frame's errors that is kept
  RoundedSigns signs = RoundedSigns::kMayChange;  ///< kKept: a code keeps its sign
};

/// Codes the positions of the bricks of a frame. A reader sets `bricks`.
/// \param maxNew  largest number of bricks that neither are in the previous frame nor touch it
/// \throws BadInput  a reader finds more of these, or a brick twice
void codeFrameBricks(Writer& side, const PastVoxels& past, std::vector<Coord>& bricks);
void codeFrameBricks(Reader& side, const PastVoxels& past, std::uint64_t maxNew,
                     std::vector<Coord>& bricks);

/// Replaces codes by codes near them, as chooseCodes() does for a volume of its own.
void chooseFrameCodes(std::span<const std::size_t> order, const PastVoxels& past,
                      const FrameThrift& thrift, VoxelLayer& layer);

/// Writes the bricks in the given order, which must be that of codeVoxels().
void codeFrameVoxels(Writer& side, std::span<const std::size_t> order, const PastVoxels& past,
                     VoxelLayer& layer);
/// Reads the codes and masks of a layer whose bricks are set.
/// \throws BadInput  a code is out of range
void codeFrameVoxels(Reader& side, std::span<const std::size_t> order, const PastVoxels& past,
                     VoxelLayer& layer);

}  // namespace esvr::codec
