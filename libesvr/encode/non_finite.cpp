// Values in place of voxels that are NaN or infinite, and the conversion of a volume that has them.

#include "encode/non_finite.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/brick_index.h"
#include "core/parallel.h"
#include "encode/job.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/metrics.h"
#include "esvr/quantised.h"
#include "format/non_finite_section.h"
#include "format/section_writer.h"

namespace esvr::encode {

// ---- Values from the neighbours

namespace {

struct VoxelPlace {
  std::uint32_t brick = 0;
  std::int32_t v = 0;
};

/// Fills voxels in rounds: those beside a voxel with a value first, and then those beside them. Each round reads values
/// of earlier rounds only, so that the order within it does not matter. Means have creases where rounds from different
/// sides meet, which a fit would pay for. They are therefore relaxed until each voxel is about the mean of all its neighbours,
/// which is the smoothest continuation of the values around.
class Filler {
 public:
  Filler(SparseVolume& volume, Filling filling)
      : volume_(volume),
        filling_(filling),
        index_(volume.bricks),
        missing_(volume.brickCount()),
        isQueued_(volume.brickCount()) {
    for (std::size_t b = 0; b < volume.brickCount(); ++b)
      for (int v = 0; v < kBrickVoxels; ++v)
        if (volume.active[b].test(v) && !std::isfinite(volume.brickValues(b)[std::size_t(v)]))
          missing_[b].set(v);
  }

  /// \param range  of the values that are there
  void run(const ValueRange& range) {
    std::vector<BrickMask> filled = missing_;
    int rounds = 0;
    for (auto round = firstRound(); !round.empty(); round = nextRound(round), ++rounds) fill(round);
    const float rest = std::clamp(volume_.background, range.min, range.max);
    for (std::size_t b = 0; b < volume_.brickCount(); ++b)
      forEachActive(missing_[b], [&](int v) {
        volume_.brickValues(b)[std::size_t(v)] = rest;
        filled[b].reset(v);
      });
    if (filling_ == Filling::kMeans) relax(filled, rounds, range);
  }

 private:
  static constexpr std::array<Coord, 6> kSteps{
      {{0, 0, -1}, {0, -1, 0}, {-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

  /// Calls use(neighbour) for the active neighbours of a voxel, until it returns false.
  template <class Use>
  void forEachNeighbour(const VoxelPlace& place, const Use& use) const {
    const Coord voxel = volume_.bricks[place.brick] * kBrickSide + voxelLocal(place.v);
    for (const Coord step : kSteps) {
      const Coord at = voxel + step;
      const Coord brick = brickOf(at);
      const std::uint32_t b =
          brick == volume_.bricks[place.brick] ? place.brick : index_.find(brick);
      if (b == BrickIndex::kNone) continue;
      const int v = voxelOffset(localOf(at));
      if (volume_.active[b].test(v) && !use(VoxelPlace{b, v})) return;
    }
  }

  [[nodiscard]] bool isMissing(const VoxelPlace& p) const { return missing_[p.brick].test(p.v); }

  std::vector<VoxelPlace> firstRound() {
    std::vector<VoxelPlace> round;
    for (std::uint32_t b = 0; b < volume_.brickCount(); ++b)
      forEachActive(missing_[b], [&](int v) {
        const VoxelPlace place{b, v};
        forEachNeighbour(place, [&](const VoxelPlace& neighbour) {
          if (isMissing(neighbour)) return true;
          isQueued_[b].set(v);
          round.push_back(place);
          return false;
        });
      });
    return round;
  }

  std::vector<VoxelPlace> nextRound(const std::vector<VoxelPlace>& round) {
    std::vector<VoxelPlace> next;
    for (const VoxelPlace& place : round)
      forEachNeighbour(place, [&](const VoxelPlace& neighbour) {
        if (isMissing(neighbour) && !isQueued_[neighbour.brick].test(neighbour.v)) {
          isQueued_[neighbour.brick].set(neighbour.v);
          next.push_back(neighbour);
        }
        return true;
      });
    return next;
  }

  void fill(const std::vector<VoxelPlace>& round) {
    throwIfCancelled();
    std::vector<float> values(round.size());
    parallelFor(std::size_t{0}, round.size(),
                [&](std::size_t i) { values[i] = valueAt(round[i]); });
    for (std::size_t i = 0; i < round.size(); ++i) {
      volume_.brickValues(round[i].brick)[std::size_t(round[i].v)] = values[i];
      missing_[round[i].brick].reset(round[i].v);
    }
  }

  [[nodiscard]] float valueAt(const VoxelPlace& place) const {
    double sum = 0.0, count = 0.0;
    forEachNeighbour(place, [&](const VoxelPlace& neighbour) {
      if (isMissing(neighbour)) return true;
      sum += volume_.brickValues(neighbour.brick)[std::size_t(neighbour.v)];
      count += 1.0;
      return filling_ == Filling::kMeans;
    });
    return float(sum / count);
  }

  /// Successive over-relaxation. Neighbours differ in the parity of their coordinates, so that a sweep over one parity
  /// reads values of the other one only.
  /// \param rounds  the number in which they were filled, which is about half the width of the widest gap
  void relax(const std::vector<BrickMask>& filled, int rounds, const ValueRange& range) {
    // Wider gaps remain uneven at lengths that cost a fit nothing.
    constexpr int kMostSweeps = 120;
    // The best factor for a gap of this width; it is smooth after some three times as many sweeps as it has rounds.
    const double factor = 2.0 / (1.0 + std::sin(std::numbers::pi / (2.0 * rounds + 1.0)));
    for (int sweep = 0; sweep < std::min(3 * rounds + 10, kMostSweeps); ++sweep)
      for (const int parity : {0, 1})
        parallelFor(std::size_t{0}, filled.size(), [&](std::size_t b) {
          forEachActive(filled[b], [&](int v) {
            const Coord at = voxelLocal(v);
            if (((at.x ^ at.y ^ at.z) & 1) != parity) return;
            float& value = volume_.brickValues(b)[std::size_t(v)];
            const double moved = value + factor * (valueAt({std::uint32_t(b), v}) - value);
            value = float(std::clamp(moved, double(range.min), double(range.max)));
          });
        });
  }

  SparseVolume& volume_;
  Filling filling_;
  BrickIndex index_;
  std::vector<BrickMask> missing_, isQueued_;
};

}  // namespace

SparseVolume withFilledVoxels(const SparseVolume& volume, ValueType valueType, Filling filling) {
  SparseVolume filled = volume;
  Filler(filled, filling).run(activeRange(volume));
  if (valueType == ValueType::kHalf) roundToHalfs(filled);
  return filled;
}

// ---- The conversion

namespace {

bool storesValues(const Goal& goal) {
  const auto* within = std::get_if<BoundGoal>(&goal);
  return std::holds_alternative<LosslessGoal>(goal) || (within && within->bound == 0.0);
}

/// Takes the bytes of the voxels that are not finite from a size.
void takeBytes(const StoredGrid& kept, const ConvertOptions& options, SizeGoal& goal) {
  constexpr std::uint64_t kCounts = 15;       // their numbers in the record of the grid, at most
  constexpr std::uint64_t kSameAsBefore = 8;  // a section of a frame without content
  const StoredGrid* const before = options.previous;
  const bool isSame = before && before->nonFiniteVoxels == kept.nonFiniteVoxels;
  const std::uint64_t bytes = kCounts + (isSame ? kSameAsBefore : format::bytesOfNonFinite(kept));
  if (bytes >= goal.bytes)
    throw UsageError("the places of the voxels of grid '" + shownName(kept.descriptor.name) +
                     "' that are not finite take " + std::to_string(bytes) +
                     " bytes; the size allows " + std::to_string(goal.bytes));
  goal.bytes -= bytes;
}

/// The options with which the other voxels reach the goal. The squared error of the filled ones only adds to that of
/// the others, so that a PSNR over all voxels that is higher by the share of the others suffices.
ConvertOptions adapted(const SparseVolume& source, const StoredGrid& kept, ConvertOptions options) {
  const Box box = options.fit.box.value_or(activeBox(source));
  options.filled = &*kept.nonFiniteVoxels;
  const double left = box.volume() - double(filledIn(box, options));
  const double gain = left > 0.0 ? 10.0 * std::log10(box.volume() / left) : 0.0;
  if (auto* psnr = std::get_if<PsnrGoal>(&options.goal)) psnr->psnr += gain;
  if (options.fit.psnr) *options.fit.psnr += gain;
  if (auto* size = std::get_if<SizeGoal>(&options.goal)) takeBytes(kept, options, *size);
  return options;
}

}  // namespace

Conversion convertKeepingNonFinite(const ConvertInput& input, const ConvertOptions& options,
                                   const FiniteConversion& convert) {
  StoredGrid kept;
  kept.descriptor = input.descriptor;
  kept.nonFiniteVoxels = format::nonFiniteLayer(input.source);
  if (!kept.nonFiniteVoxels) return convert(input, options);
  kept.nonFinite = format::countsOf(*kept.nonFiniteVoxels);
  const ConvertOptions own = adapted(input.source, kept, options);
  const SparseVolume source =
      withFilledVoxels(input.source, input.descriptor.valueType,
                       storesValues(options.goal) ? Filling::kCopies : Filling::kMeans);
  Conversion made = convert({input.descriptor, source}, own);
  made.grid.nonFinite = kept.nonFinite;
  made.grid.nonFiniteVoxels = std::move(kept.nonFiniteVoxels);
  return made;
}

}  // namespace esvr::encode
