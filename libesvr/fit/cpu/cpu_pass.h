#pragma once
/// Passes over the bricks on the CPU: lists of (ellipsoid, brick) pairs, the forward and the
/// backward pass over a brick, and the sum over an ellipsoid's pairs. The default fit and the
/// paper's method use them with different losses.

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>
#include <span>
#include <vector>

#include "core/brick_index.h"
#include "field/brick_kernels.h"
#include "field/brick_pairs.h"
#include "fit/adam.h"
#include "fit/motion_bound.h"
#include "fit/target.h"

namespace esvr {

/// Uninitialised floats with the alignment of the widest SIMD vectors.
class AlignedFloats {
 public:
  AlignedFloats() = default;
  explicit AlignedFloats(std::size_t size)
      : floats_(
            static_cast<float*>(::operator new[](size * sizeof(float), std::align_val_t(kAlign)))) {
  }
  [[nodiscard]] float* get() const { return floats_.get(); }

 private:
  static constexpr std::size_t kAlign = 64;
  struct Delete {
    void operator()(float* p) const { ::operator delete[](p, std::align_val_t(kAlign)); }
  };
  std::unique_ptr<float[], Delete> floats_;
};

/// A thread's tapes for the pairs of one brick. The memory is reused for the next brick.
struct PairTapes {
  std::vector<PairTape> tapes;
  AlignedFloats phi;  ///< at most kBrickVoxels values for each pair
  std::size_t capacity = 0;

  void reserve(std::size_t pairs) {
    tapes.resize(pairs);
    if (pairs * kBrickVoxels <= capacity) return;
    capacity = 2 * pairs * kBrickVoxels;
    phi = AlignedFloats(capacity);
  }
};

/// The kernels of ellipsoids: one that all share, or one for each.
struct PassKernels {
  std::vector<KernelConstants<float>> all;
  std::vector<double> radii;  ///< radii of the supports in the unit frame

  PassKernels() = default;
  /// A kernel that all ellipsoids share.
  explicit PassKernels(const KernelConstants<double>& kernel) : all(1), radii(1) { set(0, kernel); }

  void resize(std::size_t count) {
    all.resize(count);
    radii.resize(count);
  }
  void set(std::size_t i, const KernelConstants<double>& kernel) {
    all[i] = narrowed(kernel);
    radii[i] = supportRadius(kernel);
  }
  [[nodiscard]] const KernelConstants<float>& constants(std::size_t i) const {
    return all[all.size() == 1 ? 0 : i];
  }
  [[nodiscard]] double radius(std::size_t i) const { return radii[radii.size() == 1 ? 0 : i]; }
};

/// Holds the pair lists and the prepared forms. The lists are valid until a support has moved by
/// more than the slack they were built with; the caller decides when to rebuild them.
class CpuPass {
 public:
  /// The target must outlive the pass.
  CpuPass(const FitTarget& target, PassKernels kernels);
  CpuPass(const FitTarget& target, const KernelConstants<double>& kernel)
      : CpuPass(target, PassKernels(kernel)) {}

  /// Sets the kernels. If their radii differ, the lists must then be rebuilt.
  void setKernels(PassKernels kernels) { kernels_ = std::move(kernels); }

  /// Rebuilds the lists with supports that are widened by `slack` voxels.
  void rebuild(std::span<const Ellipsoid> ellipsoids, double slack);
  /// Rebuilds the lists with supports as they are to be listed.
  void rebuild(std::span<const ListedSupport> listed);

  /// Writes r = V - target for every brick: the target's bricks first, then other bricks that
  /// supports reach.
  void residuals(std::span<const Ellipsoid> ellipsoids, std::vector<float>& out);

  /// Computes the gradients of 1/2 sum r^2 with r = V - target over all bricks of the lists. If
  /// FitTarget::saturates, V is clamped, and the loss goes on linearly beyond the range: its
  /// derivative by the sum is r there too, so that a sum far beyond the range is pulled back unless
  /// the target is the range's end.
  /// \param residuals  also gets what residuals() writes, if it is not null
  /// \return sum of r^2
  double gradients(std::span<const Ellipsoid> ellipsoids, std::span<EllipsoidGradient> out,
                   std::vector<float>* residuals = nullptr);

  /// Computes the gradients of another loss from its derivative by V.
  /// \param lossByValue  kBrickVoxels values for each brick, in the order of residuals()
  void gradients(std::span<const Ellipsoid> ellipsoids, std::span<const float> lossByValue,
                 std::span<EllipsoidGradient> out);

  [[nodiscard]] const BrickIndex& index() const { return index_; }
  [[nodiscard]] const BrickPairs& pairs() const { return pairs_; }

 private:
  void listSupports();
  void prepare(std::span<const Ellipsoid> ellipsoids);
  void start(std::size_t brick, float* r) const;
  double finish(std::size_t brick, float* r) const;
  void forward(std::size_t brick, PairTapes& scratch, float* sum) const;
  void backward(std::size_t brick, const PairTapes& scratch, const float* byValue);
  void reduce(std::span<EllipsoidGradient> out) const;

  const FitTarget& target_;
  PassKernels kernels_;
  BrickIndex index_;
  BrickPairs pairs_;
  std::vector<Support> supports_;  ///< supports in the current lists
  std::vector<BrickForm> forms_;
  std::vector<Coord> frames_;  ///< origin of each form's center, near it for float32 precision
  std::vector<std::uint32_t> placeOf_;  ///< by pair: the place of its moments
  std::vector<PairMoments> moments_;    ///< of all pairs, in the order of the ellipsoids
  std::vector<double> brickLoss_;
  tbb::enumerable_thread_specific<PairTapes> tapes_;
};

}  // namespace esvr
