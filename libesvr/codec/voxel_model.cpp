// The model of a layer, which an encoder chooses: the frequent codes and the mirrors.

#include "codec/voxel_coder.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <unordered_map>
#include <utility>

#include "core/brick_index.h"
#include "core/geometry.h"
#include "core/parallel.h"

namespace esvr::codec {
namespace {

constexpr std::size_t kCommonShare = 512;   // a code is common if 1 of 512 voxels has it
constexpr std::size_t kSamples = 2048;      // voxels that are compared with their images
constexpr double kAlike = 0.4;              // share of equal samples above which a mirror is tried
constexpr std::size_t kFirstSamples = 128;  // the samples that are compared first, and
constexpr double kFirstAlike = kAlike / 2.0;  // their share for the others to be compared
constexpr std::int32_t kMaxExtent = 1 << 14;  // voxels; the search is skipped for larger grids

bool vacantAt(const VoxelLayer& layer, std::size_t i) {
  return layer.vacant[i / kBrickVoxels].test(int(i % kBrickVoxels));
}

/// The code that vacant voxels count as in predictions. Any code is correct; the code that they
/// have in the layer, which is near the background, gives the best predictions.
std::int32_t vacantCodeOf(const VoxelLayer& layer) {
  for (std::size_t i = 0; i < layer.codes.size(); ++i)
    if (vacantAt(layer, i)) return layer.codes[i];
  return 0;
}

using Counts = std::unordered_map<std::int32_t, std::size_t>;

/// Calls visit(code) for all voxels that are not vacant.
template <class Visit>
void forEachCode(const VoxelLayer& layer, const Visit& visit) {
  for (std::size_t b = 0; b < layer.bricks.size(); ++b) {
    throwIfCancelled();
    const auto codes = layer.codes.begin() + std::ptrdiff_t(b * kBrickVoxels);
    for (int v = 0; v < kBrickVoxels; ++v)
      if (!layer.vacant[b].test(v)) visit(codes[v]);
  }
}

/// The codes that a sample of the voxels has often, each with a count of 0. Most voxels of a volume of
/// floats have codes of their own, of which a table would take more time than the coder.
Counts frequentCodes(const VoxelLayer& layer) {
  constexpr std::size_t kSampled = 1 << 16;
  const std::size_t every = std::max<std::size_t>(layer.codes.size() / kSampled, 1);
  std::vector<std::int32_t> sample;
  std::size_t seen = 0;
  forEachCode(layer, [&](std::int32_t code) {
    if (seen++ % every == 0) sample.push_back(code);
  });
  std::sort(sample.begin(), sample.end());
  Counts frequent;
  for (auto first = sample.begin(); first != sample.end();) {
    const auto end = std::upper_bound(first, sample.end(), *first);
    if (std::size_t(end - first) * 2 * kCommonShare >= sample.size()) frequent.emplace(*first, 0);
    first = end;
  }
  return frequent;
}

std::vector<std::int32_t> commonCodes(const VoxelLayer& layer) {
  if (layer.form != VoxelForm::kFloat && layer.form != VoxelForm::kHalf) return {};
  Counts counts = frequentCodes(layer);
  if (counts.empty()) return {};
  std::size_t voxels = 0;
  forEachCode(layer, [&](std::int32_t code) {
    ++voxels;
    if (const auto found = counts.find(code); found != counts.end()) ++found->second;
  });
  std::vector<std::pair<std::size_t, std::int32_t>> often;
  for (const auto& [code, count] : counts)
    if (count * kCommonShare >= voxels) often.emplace_back(count, code);
  std::sort(often.begin(), often.end(), std::greater<>());
  if (often.size() > VoxelModel::kMaxCommon) often.resize(VoxelModel::kMaxCommon);
  std::vector<std::int32_t> codes;
  for (const auto& [count, code] : often) codes.push_back(code);
  return codes;
}

struct Sample {
  Coord place;  ///< voxels from the layer's origin
  std::int32_t code = 0;
};

class MirrorSearch {
 public:
  MirrorSearch(const VoxelLayer& layer, std::int32_t vacantCode)
      : layer_(layer), vacantCode_(vacantCode), index_(layer.bricks) {
    takeSamples();
    for (const Coord brick : layer.bricks)
      last_ = maxCoord(last_, brick * kBrickSide + Coord{7, 7, 7});
  }

  /// The best mirror along an axis, if it lies in the middle half of the grid.
  [[nodiscard]] std::int32_t along(std::int32_t Coord::*axis) const {
    const std::int32_t extent = last_.*axis + 1;
    if (samples_.empty() || extent > kMaxExtent) return VoxelModel::kNoMirror;
    const std::int32_t first = extent / 2;
    std::vector<std::size_t> counts(static_cast<std::size_t>(extent));
    parallelFor(std::size_t{0}, counts.size(),
                [&](std::size_t n) { counts[n] = alike(axis, first + std::int32_t(n)); });
    const auto most = std::max_element(counts.begin(), counts.end());
    if (double(*most) <= kAlike * double(samples_.size())) return VoxelModel::kNoMirror;
    return first + std::int32_t(most - counts.begin());
  }

 private:
  /// Takes samples evenly among the voxels that are not vacant. Every 16th one moves to the front, so that the first ones
  /// are even too.
  void takeSamples() {
    std::size_t voxels = 0, seen = 0;
    for (const BrickMask& vacant : layer_.vacant)
      voxels += std::size_t(kBrickVoxels - vacant.count());
    const std::size_t every = std::max<std::size_t>(voxels / kSamples, 1);
    for (std::size_t b = 0; b < layer_.bricks.size(); ++b)
      for (int v = 0; v < kBrickVoxels; ++v) {
        if (layer_.vacant[b].test(v) || seen++ % every != 0) continue;
        samples_.push_back({layer_.bricks[b] * kBrickSide + voxelLocal(v),
                            layer_.codes[b * std::size_t(kBrickVoxels) + std::size_t(v)]});
      }
    constexpr std::size_t kStride = kSamples / kFirstSamples;
    for (std::size_t n = 0; n * kStride < samples_.size(); ++n)
      std::swap(samples_[n], samples_[n * kStride]);
  }

  /// The number of samples that equal their images; 0 if few of the first ones do.
  [[nodiscard]] std::size_t alike(std::int32_t Coord::*axis, std::int32_t mirror) const {
    const std::span<const Sample> all(samples_);
    const auto few = all.first(std::min(kFirstSamples, all.size()));
    const std::size_t equal = countAlike(few, axis, mirror);
    if (double(equal) <= kFirstAlike * double(few.size())) return 0;
    return equal + countAlike(all.subspan(few.size()), axis, mirror);
  }

  [[nodiscard]] std::size_t countAlike(std::span<const Sample> samples, std::int32_t Coord::*axis,
                                       std::int32_t mirror) const {
    return std::size_t(std::count_if(samples.begin(), samples.end(), [&](Sample sample) {
      sample.place.*axis = mirror - sample.place.*axis;
      return codeAt(sample.place) == sample.code;
    }));
  }

  [[nodiscard]] std::int32_t codeAt(Coord place) const {
    const std::uint32_t b = index_.find(brickOf(place));
    if (b == BrickIndex::kNone) return vacantCode_;
    return layer_.codes[b * std::size_t(kBrickVoxels) + std::size_t(voxelOffset(localOf(place)))];
  }

  const VoxelLayer& layer_;
  std::int32_t vacantCode_;
  BrickIndex index_;
  Coord last_;
  std::vector<Sample> samples_;
};

}  // namespace

VoxelModel chooseModel(const VoxelLayer& layer) {
  VoxelModel model;
  model.vacantCode = vacantCodeOf(layer);
  model.common = commonCodes(layer);
  const MirrorSearch search(layer, model.vacantCode);
  for (std::size_t a = 0; a < 3; ++a) model.mirror[a] = search.along(kAxes[a]);
  return model;
}

bool hasMirror(const VoxelModel& model) {
  return std::any_of(model.mirror.begin(), model.mirror.end(),
                     [](auto mirror) { return mirror != VoxelModel::kNoMirror; });
}

VoxelModel withoutMirrors(VoxelModel model) {
  model.mirror.fill(VoxelModel::kNoMirror);
  return model;
}

}  // namespace esvr::codec
