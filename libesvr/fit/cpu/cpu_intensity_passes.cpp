// IntensityPasses on the CPU.

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "core/brick_index.h"
#include "core/parallel.h"
#include "field/brick_kernels.h"
#include "field/evaluate.h"
#include "fit/cpu/cpu_pass.h"
#include "fit/intensity_problem.h"

namespace esvr {
namespace {

constexpr std::size_t kBrickGrain = 4, kEllipsoidGrain = 256;

std::vector<Coord> asBricks(std::vector<Coord> corners) {
  for (Coord& c : corners) c = brickOf(c);
  return corners;
}

/// Sets the voxels of a mask to 0. Most words of a mask are all ones or all zeros.
void clearVoxels(const BrickMask& mask, float* values) {
  for (const std::uint64_t word : mask.words) {
    if (word == ~std::uint64_t{0}) {
      std::fill_n(values, 64, 0.0f);
    } else {
      for (std::uint64_t left = word; left != 0; left &= left - 1)
        values[std::countr_zero(left)] = 0.0f;
    }
    values += 64;
  }
}

bool contains(const Box& box, Coord corner) {
  return box.contains(corner) &&
         box.contains(corner + Coord{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1});
}

/// The errors of a brick, summed in the lanes of SIMD vectors.
StoredError sumOf(const float (&missed)[kBrickVoxels]) {
  constexpr int kLanes = 8;
  double squares[kLanes] = {};
  float largest[kLanes] = {};
  for (int v = 0; v < kBrickVoxels; v += kLanes)
    for (int k = 0; k < kLanes; ++k) {
      squares[k] += double(missed[v + k]) * double(missed[v + k]);
      largest[k] = std::max(largest[k], std::abs(missed[v + k]));
    }
  return {std::accumulate(squares, squares + kLanes, 0.0),
          *std::max_element(largest, largest + kLanes)};
}

class CpuIntensityPasses final : public IntensityPasses {
 public:
  explicit CpuIntensityPasses(const IntensityTarget& target);

  void setShapes(const Field& field) override;
  [[nodiscard]] StoredError error(std::span<const float> intensities) override;
  StoredError gradient(std::span<const float> intensities, IntensityGradient& out) override;
  void applyNormal(std::span<const double> direction, std::vector<double>& out) override;

 private:
  template <class Number>
  void setForms(std::span<const Number> intensities);
  /// Residuals of one brick; they are zero at voxels that a reader gets exactly.
  StoredError residualOf(std::size_t brick, float* sum, BrickMask* exact) const;
  void forward(std::size_t brick, PairTapes* tapes, float* sum) const;
  template <class Middle>
  void pass(bool backward, const Middle& middle);
  void sumPairs(float PairProjection::*value, std::vector<double>& out) const;
  [[nodiscard]] StoredError total() const;

  const SparseVolume& source_;
  VoxelRule stored_;
  Box box_;
  bool restricted_;
  BrickIndex known_;  ///< bricks that do not depend on the field
  float background_ = 0.0f;
  std::vector<Coord> corners_;        ///< corners of known bricks, then of others in reach
  std::vector<const float*> wanted_;  ///< source's values of known bricks; null: background
  EvaluatePlan plan_;
  std::vector<PairProjection> projections_;
  std::vector<StoredError> brickError_;
  std::vector<BrickMask> exact_;
};

CpuIntensityPasses::CpuIntensityPasses(const IntensityTarget& target)
    : source_(target.source),
      stored_(target.rule),
      box_(target.box),
      restricted_(target.restrictToBricks),
      known_(asBricks(knownCorners(target))) {
  for (const Coord brick : known_.bricks())
    wanted_.push_back(sourceValues(source_, brick * kBrickSide));
}

void CpuIntensityPasses::setShapes(const Field& field) {
  background_ = field.background;
  const auto reach = supports(field);
  const SupportOf supportOf = [&](std::size_t i) -> const Support& { return reach[i]; };
  BrickIndex index = known_;
  plan_.field = gather(field);
  plan_.pairs = restricted_ ? pairsWithin(index, reach.size(), supportOf)
                            : pairsOfAll(index, reach.size(), supportOf);
  corners_.clear();
  for (const Coord brick : index.bricks()) corners_.push_back(brick * kBrickSide);
  projections_.resize(plan_.pairs.pairCount());
  brickError_.resize(corners_.size());
  exact_.assign(corners_.size(), {});
}

template <class Number>
void CpuIntensityPasses::setForms(std::span<const Number> intensities) {
  for (std::size_t i = 0; i < intensities.size(); ++i)
    plan_.field.forms[i].intensity = float(intensities[i]);
}

/// Adds up a brick's ellipsoids. \param tapes  records their phi; null if no backward pass follows
void CpuIntensityPasses::forward(std::size_t brick, PairTapes* tapes, float* sum) const {
  const BrickKernels& kernels = brickKernels();
  const auto& [gathered, pairs] = plan_;
  const auto begin = pairs.brickBegin[brick], end = pairs.brickBegin[brick + 1];
  if (tapes) tapes->reserve(end - begin);
  float* phi = tapes ? tapes->phi.get() : nullptr;
  for (auto pair = begin; pair != end; ++pair) {
    const auto i = pairs.ellipsoid[pair];
    const auto corner = gathered.fromOrigin(i, corners_[brick]);
    if (!tapes) {
      kernels.add(gathered.forms[i], corner.data(), gathered.kernel(i), sum);
      continue;
    }
    PairTape& tape = tapes->tapes[pair - begin];
    tape.phi = phi;
    kernels.forward(gathered.forms[i], corner.data(), gathered.kernel(i), sum, tape);
    phi += tape.floats;
  }
}

/// For every brick: a forward pass, middle(brick, sum), which turns the sum into the values that
/// are projected on the ellipsoids, and, if wanted, a backward pass. Tapes do not stay from one pass
/// to the next: to compute them again takes no longer than to read them from memory.
template <class Middle>
void CpuIntensityPasses::pass(bool backward, const Middle& middle) {
  tbb::enumerable_thread_specific<PairTapes> scratches;
  parallelFor(tbb::blocked_range<std::size_t>(0, corners_.size(), kBrickGrain),
              [&](const auto& range) {
                PairTapes* const tapes = backward ? &scratches.local() : nullptr;
                for (std::size_t b = range.begin(); b != range.end(); ++b) {
                  alignas(64) float sum[kBrickVoxels] = {};
                  forward(b, tapes, sum);
                  middle(b, sum);
                  if (!backward) continue;
                  const auto begin = plan_.pairs.brickBegin[b];
                  const auto end = plan_.pairs.brickBegin[b + 1];
                  for (auto pair = begin; pair != end; ++pair)
                    brickKernels().project(tapes->tapes[pair - begin], sum, projections_[pair]);
                }
              });
}

void CpuIntensityPasses::sumPairs(float PairProjection::*value, std::vector<double>& out) const {
  const auto& pairs = plan_.pairs;
  const std::size_t n = plan_.field.forms.size();
  out.assign(n, 0.0);
  parallelFor(tbb::blocked_range<std::size_t>(0, n, kEllipsoidGrain), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      for (auto k = pairs.ellipsoidBegin[i]; k != pairs.ellipsoidBegin[i + 1]; ++k)
        out[i] += double(projections_[pairs.pairOf[k]].*value);
  });
}

StoredError CpuIntensityPasses::residualOf(std::size_t brick, float* sum, BrickMask* exact) const {
  alignas(64) float missed[kBrickVoxels], background[kBrickVoxels];
  const float* target = brick < wanted_.size() ? wanted_[brick] : nullptr;
  if (!target) target = std::fill_n(background, kBrickVoxels, source_.background) - kBrickVoxels;
  const auto compare = [&](const VoxelRule& rule) {
    for (int v = 0; v < kBrickVoxels; ++v) {
      const float value = background_ + sum[v];
      missed[v] = rule(value) - target[v];
      sum[v] = missed[v] == 0.0f ? 0.0f : value - target[v];
    }
  };
  VoxelRule plain = stored_;
  plain.tone = {};  // without a curve, the loop becomes vector instructions
  stored_.tone.isOn() ? compare(stored_) : compare(plain);
  if (exact)
    for (int v = 0; v < kBrickVoxels; ++v)
      exact->words[std::size_t(v / 64)] |= std::uint64_t(missed[v] == 0.0f) << (v % 64);
  const Coord corner = corners_[brick];
  if (!contains(box_, corner))
    for (int v = 0; v < kBrickVoxels; ++v)
      if (!box_.contains(corner + voxelLocal(v))) missed[v] = 0.0f;
  return sumOf(missed);
}

StoredError CpuIntensityPasses::total() const {
  StoredError total;
  for (const StoredError& e : brickError_) {
    total.squares += e.squares;
    total.largest = std::max(total.largest, e.largest);
  }
  return total;
}

StoredError CpuIntensityPasses::error(std::span<const float> intensities) {
  setForms(intensities);
  pass(false, [&](std::size_t b, float* sum) { brickError_[b] = residualOf(b, sum, nullptr); });
  return total();
}

StoredError CpuIntensityPasses::gradient(std::span<const float> intensities,
                                         IntensityGradient& out) {
  setForms(intensities);
  pass(true, [&](std::size_t b, float* sum) {
    exact_[b] = {};
    brickError_[b] = residualOf(b, sum, &exact_[b]);
  });
  sumPairs(&PairProjection::rPhi, out.byIntensity);
  sumPairs(&PairProjection::phi2, out.curvature);
  return total();
}

void CpuIntensityPasses::applyNormal(std::span<const double> direction, std::vector<double>& out) {
  setForms(direction);
  pass(true, [&](std::size_t b, float* sum) { clearVoxels(exact_[b], sum); });
  sumPairs(&PairProjection::rPhi, out);
}

}  // namespace

std::unique_ptr<IntensityPasses> makeCpuIntensityPasses(const IntensityTarget& target) {
  return std::make_unique<CpuIntensityPasses>(target);
}

}  // namespace esvr
