#pragma once
/// The common part of the fits' passes on the CPU: lists of (ellipsoid, brick) pairs, the forward
/// and the backward pass over one brick, and the sum over an ellipsoid's pairs. Derived passes
/// differ in their loss (cpu_pass.h, paper/cpu_paper_pass.h).

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "field/brick_kernels.h"
#include "field/brick_pairs.h"
#include "field/gather.h"
#include "fit/adam.h"
#include "fit/cpu/pair_tapes.h"
#include "fit/ellipsoid.h"
#include "fit/frame.h"
#include "fit/listed_support.h"
#include "fit/parameter_gradient.h"
#include "fit/target.h"

namespace esvr {

/// Holds the pair lists and the prepared forms. The lists are valid until a support has moved by
/// more than the slack they were built with; the caller decides when to rebuild them.
/// \tparam Kernels  a type with constants(i) and radius(i): the kernel of ellipsoid i, and the
///                  radius of its support in the unit frame
template <class Kernels>
class PairPass {
 public:
  /// The target must outlive the pass.
  PairPass(const FitTarget& target, const Kernels& kernels)
      : target_(target), kernels_(kernels), index_(target.bricks) {}

  /// Sets the kernels; the lists must then be rebuilt.
  void setKernels(const Kernels& kernels) { kernels_ = kernels; }
  [[nodiscard]] const Kernels& kernels() const { return kernels_; }

  /// Rebuilds the lists with supports that are widened by `slack` voxels.
  void rebuild(std::span<const Ellipsoid> ellipsoids, double slack) {
    supports_.resize(ellipsoids.size());
    forEachEllipsoid(ellipsoids.size(), [&](std::size_t i) {
      supports_[i] = makeSupport(ellipsoids[i].center, ellipsoids[i].L, kernels_.radius(i), slack);
    });
    listSupports();
  }
  /// Builds the lists anew, of supports as they are to be listed.
  void rebuild(std::span<const ListedSupport> listed) {
    supports_.resize(listed.size());
    forEachEllipsoid(listed.size(), [&](std::size_t i) {
      supports_[i] = makeSupport(listed[i].center, listed[i].L, listed[i].reach, kRoundingSlack);
    });
    listSupports();
  }

  /// Writes r = V - target for every brick: the target's bricks first, then other bricks that
  /// supports reach.
  void residuals(std::span<const Ellipsoid> ellipsoids, std::vector<float>& out) {
    prepare(ellipsoids);
    out.resize(brickCount() * kBrickVoxels);
    forEachBrick([&](std::size_t b) {
      alignas(64) float r[kBrickVoxels], t[kBrickVoxels];
      readTarget(b, t);
      startFrom(b, t, r);
      const Coord corner = index_.bricks()[b] * kBrickSide;
      for (auto pair = pairs_.brickBegin[b]; pair != pairs_.brickBegin[b + 1]; ++pair) {
        const auto i = pairs_.ellipsoid[pair];
        brickKernels().add(forms_[i], cornerIn(frames_[i], corner).data(), kernels_.constants(i),
                           r);
      }
      if (target_.saturates) saturate(t, r);
      std::copy_n(r, kBrickVoxels, out.data() + b * kBrickVoxels);
    });
  }

  [[nodiscard]] const FitTarget& target() const { return target_; }
  [[nodiscard]] const BrickIndex& index() const { return index_; }
  [[nodiscard]] std::size_t brickCount() const { return index_.size(); }
  [[nodiscard]] const BrickPairs& pairs() const { return pairs_; }

 protected:
  using Range = tbb::blocked_range<std::size_t>;

  template <class Visit>
  static void forEachEllipsoid(std::size_t count, const Visit& visit) {
    constexpr std::size_t kGrain = 64;
    parallelFor(Range(0, count, kGrain), [&](const Range& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) visit(i);
    });
  }

  template <class Visit>
  void forEachBrick(const Visit& visit) const {
    constexpr std::size_t kGrain = 4;
    parallelFor(Range(0, brickCount(), kGrain), [&](const Range& range) {
      for (std::size_t b = range.begin(); b != range.end(); ++b) visit(b);
    });
  }

  /// Computes the forms of the current ellipsoids.
  void prepare(std::span<const Ellipsoid> ellipsoids) {
    forms_.resize(ellipsoids.size());
    frames_.resize(ellipsoids.size());
    forEachEllipsoid(ellipsoids.size(), [&](std::size_t i) {
      const Ellipsoid& p = ellipsoids[i];
      frames_[i] = frameOf(p.center);
      const auto center = inFrame(p.center, frames_[i]);
      forms_[i] = makeLineForm(center, p.L, kernels_.radius(i), p.intensity);
    });
  }

  /// Reads the target's values of a brick.
  void readTarget(std::size_t brick, float* t) const { read(target_.values, brick, t); }

  /// Starts a sum: r = constants - t.
  void startFrom(std::size_t brick, const float* t, float* r) const {
    for (int v = 0; v < kBrickVoxels; ++v) r[v] = -t[v];
    if (target_.constants.empty()) return;
    alignas(64) float constants[kBrickVoxels];
    read(target_.constants, brick, constants);
    for (int v = 0; v < kBrickVoxels; ++v) r[v] += constants[v];
  }

  /// Replaces r = V - t by clamp(V, lowest, highest) - t.
  void saturate(const float* t, float* r) const {
    const auto low = float(target_.lowest), high = float(target_.highest);
    for (int v = 0; v < kBrickVoxels; ++v) r[v] = std::clamp(r[v], low - t[v], high - t[v]);
  }

  /// Adds the sum to r and records phi on the tapes.
  void forwardBrick(std::size_t brick, PairTapes& scratch, float* r) const {
    const auto begin = pairs_.brickBegin[brick], end = pairs_.brickBegin[brick + 1];
    const Coord corner = index_.bricks()[brick] * kBrickSide;
    const BrickKernels& kernels = brickKernels();
    scratch.reserve(end - begin);
    float* phi = scratch.phi.get();
    for (auto pair = begin; pair != end; ++pair) {
      const auto i = pairs_.ellipsoid[pair];
      PairTape& tape = scratch.tapes[pair - begin];
      tape.phi = phi;
      const auto at = cornerIn(frames_[i], corner);
      kernels.forward(forms_[i], at.data(), kernels_.constants(i), r, tape);
      phi += tape.floats;
    }
  }

  /// Computes the moments of the brick's pairs. \param byValue  derivative of the loss by V
  void backwardBrick(std::size_t brick, const PairTapes& scratch, const float* byValue) {
    const auto begin = pairs_.brickBegin[brick], end = pairs_.brickBegin[brick + 1];
    const Coord corner = index_.bricks()[brick] * kBrickSide;
    const BrickKernels& kernels = brickKernels();
    for (auto pair = begin; pair != end; ++pair) {
      const auto i = pairs_.ellipsoid[pair];
      const auto at = cornerIn(frames_[i], corner);
      kernels.backward(forms_[i], at.data(), kernels_.constants(i), byValue,
                       scratch.tapes[pair - begin], moments_[pair]);
    }
  }

  /// Computes the gradients from the moments of all pairs.
  void reduce(std::span<EllipsoidGradient> out) const {
    forEachEllipsoid(forms_.size(), [&](std::size_t i) {
      PairSums sums{};
      for (auto k = pairs_.ellipsoidBegin[i]; k != pairs_.ellipsoidBegin[i + 1]; ++k)
        sums.add(moments_[pairs_.pairOf[k]]);
      out[i] = ellipsoidGradient(forms_[i], sums, double(kernels_.constants(i).slope));
    });
  }

  tbb::enumerable_thread_specific<PairTapes> tapes_;

 private:
  void listSupports() {
    const auto supportOf = [&](std::size_t i) -> const Support& { return supports_[i]; };
    index_ = BrickIndex(target_.bricks);
    if (!target_.narrowBand) appendReached(supports_.size(), supportOf);
    pairs_ = pairsWithin(index_, supports_.size(), supportOf);
    moments_.resize(pairs_.pairCount());
  }

  /// Reads values of a brick, `all` being those of the target's bricks; the others have zeros.
  void read(std::span<const float> all, std::size_t brick, float* out) const {
    if (brick < target_.bricks.size())
      std::copy_n(all.data() + brick * kBrickVoxels, kBrickVoxels, out);
    else
      std::fill_n(out, kBrickVoxels, 0.0f);
  }

  template <class SupportOf>
  void appendReached(std::size_t ellipsoids, const SupportOf& supportOf) {
    const Box within = target_.within.value_or(bricksOf(Box::whole()));
    index_.append(missingBricks(index_, ellipsoids, supportOf, within));
  }

  const FitTarget& target_;
  Kernels kernels_;
  BrickIndex index_;
  BrickPairs pairs_;
  std::vector<Support> supports_;  ///< supports in the current lists
  std::vector<LineForm> forms_;
  std::vector<Coord> frames_;  ///< origin of each form's center, near it for float32 precision
  std::vector<PairMoments> moments_;
};

}  // namespace esvr
