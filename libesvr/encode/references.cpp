// Grids that others refer to, and grids that are equal: what the grids of a file can share.

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "codec/brick_coder.h"
#include "codec/voxel_coder.h"
#include "core/parallel.h"
#include "encode/grids_of_file.h"
#include "esvr/encode.h"
#include "format/bytes.h"
#include "format/voxel_sections.h"

namespace esvr {
namespace {

/// Bricks of the sample on which candidates are compared. They follow each other in the order in
/// which voxels are coded, so that most of them are neighbours. Coding them takes about 10 ms.
constexpr std::size_t kSampleBricks = 64;
/// Candidates that are tried on the sample, of those that are most alike.
constexpr std::size_t kMostTried = 4;

/// Some bricks of a layer, in their order.
VoxelLayer partOf(const VoxelLayer& layer, const std::vector<std::size_t>& bricks) {
  VoxelLayer part;
  part.form = layer.form;
  part.divisor = layer.divisor;
  part.palette = layer.palette;
  part.origin = layer.origin;
  part.background = layer.background;
  for (const std::size_t b : bricks) {
    const auto codes = layer.codes.begin() + std::ptrdiff_t(b * kBrickVoxels);
    part.bricks.push_back(layer.bricks[b]);
    part.active.push_back(layer.active[b]);
    part.vacant.push_back(layer.vacant[b]);
    part.codes.insert(part.codes.end(), codes, codes + kBrickVoxels);
  }
  return part;
}

/// The bricks in the middle of the coding order.
VoxelLayer middleOf(const VoxelLayer& layer) {
  auto order = codec::codingOrder(layer.bricks);
  if (order.size() <= kSampleBricks) return layer;
  const auto first = order.begin() + std::ptrdiff_t((order.size() - kSampleBricks) / 2);
  std::vector<std::size_t> chosen(first, first + std::ptrdiff_t(kSampleBricks));
  std::sort(chosen.begin(), chosen.end());
  return partOf(layer, chosen);
}

Coord brickIn(const VoxelLayer& layer, Coord brick, const VoxelLayer& other) {
  return brick + brickOf(layer.origin - other.origin);
}

/// The bricks of a layer that the sample has or touches.
VoxelLayer partNear(const VoxelLayer& layer, const VoxelLayer& sample) {
  std::set<Coord> near;
  for (const Coord brick : sample.bricks)
    for (int n = 0; n < 27; ++n)
      near.insert(brickIn(sample, brick, layer) + Coord{n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1});
  std::vector<std::size_t> chosen;
  for (std::size_t b = 0; b < layer.bricks.size(); ++b)
    if (near.contains(layer.bricks[b])) chosen.push_back(b);
  return partOf(layer, chosen);
}

/// Sums over pairs of numbers.
struct ProductSums {
  double count = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;

  void add(double a, double b) {
    count += 1.0, x += a, y += b;
    xx += a * a, xy += a * b, yy += b * b;
  }
};

/// What a sample has in common with the same place of another grid.
class Likeness {
 public:
  Likeness(const SparseVolume& sample, const SparseVolume& other)
      : backgrounds_{other.background, sample.background} {
    for (std::size_t b = 0; b < sample.brickCount(); ++b) addBrick(sample, b, other);
  }

  /// Larger for grids that are more alike: by the changes along z, and by the active voxels.
  [[nodiscard]] double score() const {
    const double norm = steps_.xx * steps_.yy;
    const double alike = norm > 0.0 ? steps_.xy * steps_.xy / norm : 0.0;
    return alike + (inEither_ > 0.0 ? kWeightOfActive * inBoth_ / inEither_ : 0.0);
  }

  /// The maps of values that are tried: none, the best one, and the best one between the
  /// backgrounds.
  [[nodiscard]] std::vector<VoxelReference> maps(std::size_t grid) const {
    std::vector<VoxelReference> maps{{grid}};
    const double spread = values_.count * values_.xx - values_.x * values_.x;
    if (spread > 0.0) {
      const double gain = (values_.count * values_.xy - values_.x * values_.y) / spread;
      add(maps, gain, (values_.y - gain * values_.x) / values_.count);
    }
    if (above_.xx > 0.0) {
      const double gain = above_.xy / above_.xx;
      add(maps, gain, backgrounds_[1] - gain * backgrounds_[0]);
    }
    return maps;
  }

 private:
  static constexpr double kWeightOfActive = 0.5;

  void add(std::vector<VoxelReference>& maps, double gain, double offset) const {
    const VoxelReference map{maps.front().grid, float(gain), float(offset)};
    if (std::isfinite(map.gain) && std::isfinite(map.offset)) maps.push_back(map);
  }

  void addBrick(const SparseVolume& sample, std::size_t b, const SparseVolume& other) {
    const auto at = findBrick(other, brickOf(sample.brickCorner(b) - other.origin));
    if (!at) {
      inEither_ += sample.active[b].count();
      return;
    }
    const auto x = other.brickValues(*at), y = sample.brickValues(b);
    for (int v = 0; v < kBrickVoxels; ++v) {
      const bool mine = sample.active[b].test(v), others = other.active[*at].test(v);
      inBoth_ += mine && others;
      inEither_ += mine || others;
      if (!mine) continue;
      const auto i = std::size_t(v);
      values_.add(x[i], y[i]);
      above_.add(x[i] - backgrounds_[0], y[i] - backgrounds_[1]);
      if (voxelLocal(v).z > 0) steps_.add(x[i] - x[i - 1], y[i] - y[i - 1]);
    }
  }

  std::array<double, 2> backgrounds_;
  ProductSums values_, above_, steps_;
  double inBoth_ = 0.0, inEither_ = 0.0;
};

struct AlikeGrid {
  VoxelLayer part;
  std::vector<VoxelReference> maps;
  double score = 0.0;
};

/// A reference, the voxels that it names, and the bytes of the sample with it.
struct ReferenceTrial {
  VoxelReference reference;
  const VoxelLayer* of = nullptr;
  std::size_t bytes = std::numeric_limits<std::size_t>::max();
};

std::vector<AlikeGrid> mostAlike(std::span<const StoredGrid> grids, const VoxelLayer& sample,
                                 std::span<const std::size_t> candidates) {
  std::vector<AlikeGrid> found(candidates.size());
  const SparseVolume volume = volumeOf(sample);
  parallelFor(std::size_t{0}, candidates.size(), [&](std::size_t c) {
    const auto& voxels = grids[candidates[c]].voxels;
    if (!voxels) return;
    found[c].part = partNear(*voxels, sample);
    const Likeness likeness(volume, volumeOf(found[c].part));
    found[c].maps = likeness.maps(candidates[c]);
    found[c].score = likeness.score();
  });
  std::erase_if(found, [](const AlikeGrid& candidate) { return candidate.maps.empty(); });
  std::ranges::stable_sort(found, std::ranges::greater(), &AlikeGrid::score);
  found.resize(std::min(found.size(), kMostTried));
  return found;
}

}  // namespace

VoxelReference chooseReference(std::span<const StoredGrid> grids, std::size_t grid,
                               std::span<const std::size_t> candidates) {
  const VoxelLayer sample = middleOf(*grids[grid].voxels);
  const auto alike = mostAlike(grids, sample, candidates);
  std::vector<ReferenceTrial> trials(1);
  for (const AlikeGrid& candidate : alike)
    for (const VoxelReference& map : candidate.maps) trials.push_back({map, &candidate.part});
  parallelFor(std::size_t{0}, trials.size(), [&](std::size_t t) {
    if (const auto content = format::putRelated(sample, trials[t].reference, trials[t].of))
      trials[t].bytes = content->size();
  });
  return std::ranges::min_element(trials, {}, &ReferenceTrial::bytes)->reference;
}

StoredGrid expectedFrom(std::span<const StoredGrid> grids, std::size_t grid,
                        const VoxelReference& reference) {
  StoredGrid expected;
  expected.descriptor = grids[grid].descriptor;
  expected.tone = grids[grid].tone;
  expected.farBackground = grids[grid].farBackground;
  expected.field.background = grids[grid].field.background;
  if (!reference.grid) {
    expected.voxels = partOf(*grids[grid].voxels, {});
    return expected;
  }
  VoxelLayer& layer = *(expected.voxels = grids[*reference.grid].voxels);
  const auto mapped = [&](std::int32_t code) {
    const double value = codec::valueOfCode(layer, code);
    return codec::orderOfFloat(float(double(reference.gain) * value + double(reference.offset)));
  };
  std::ranges::transform(layer.codes, layer.codes.begin(), mapped);
  layer.form = VoxelForm::kFloat;
  layer.divisor = 1.0;
  layer.palette.clear();
  return expected;
}

// ---- Equal inputs

namespace {

template <class Items>
void putHash(format::ByteWriter& out, const Items& items) {
  const XXH128_hash_t hash = XXH3_128bits(items.data(), items.size() * sizeof(items.front()));
  for (const std::uint64_t word : {std::uint64_t(items.size()), hash.low64, hash.high64})
    out.put(word);
}

void putVolume(format::ByteWriter& out, const SparseVolume& volume) {
  for (const auto v : {volume.origin.x, volume.origin.y, volume.origin.z}) out.put(v);
  out.put(volume.background);
  putHash(out, volume.bricks);
  putHash(out, volume.values);
  putHash(out, volume.active);
}

}  // namespace

InputKey encode::activeKeyOf(const SparseVolume& volume) {
  std::vector<Coord> corners;
  std::vector<BrickMask> masks;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    if (volume.active[b].count() == 0) continue;
    corners.push_back(volume.brickCorner(b));
    masks.push_back(volume.active[b]);
  }
  format::ByteWriter out;
  putHash(out, corners);
  putHash(out, masks);
  const XXH128_hash_t hash = XXH3_128bits(out.bytes().data(), out.size());
  return {hash.low64, hash.high64};
}

InputKey keyOf(const ConvertInput& input) {
  format::ByteWriter out;
  // The class decides whether a grid is a narrow band. A lossless goal refuses doubles.
  out.put(std::uint8_t(input.descriptor.gridClass == GridClass::kLevelSet));
  out.put(std::uint8_t(input.descriptor.valueType == ValueType::kDouble));
  putVolume(out, input.source);
  const XXH128_hash_t hash = XXH3_128bits(out.bytes().data(), out.size());
  return {hash.low64, hash.high64};
}

}  // namespace esvr
