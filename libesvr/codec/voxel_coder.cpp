#include "codec/voxel_coder.h"

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <optional>

#include "codec/voxel_predictor.h"
#include "core/axes.h"
#include "esvr/error.h"

namespace esvr::codec {
namespace {

/// The mirror image of a voxel, if it was coded before the voxel.
struct Image {
  std::int32_t code = 0;
  bool active = false;
};

/// Finds the image of a voxel, along the first axis on which an image lies before it.
class Mirrors {
 public:
  Mirrors(const VoxelModel& model, const VoxelLayer& layer, const BrickIndex& index)
      : model_(model), layer_(layer), index_(index) {}

  [[nodiscard]] std::optional<Image> imageOf(Coord voxel) {
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int32_t place = model_.mirror[a] - voxel.*kAxes[a];
      if (model_.mirror[a] == VoxelModel::kNoMirror || place >= voxel.*kAxes[a]) continue;
      voxel.*kAxes[a] = place;
      return at(voxel);
    }
    return std::nullopt;
  }

 private:
  Image at(Coord voxel) {
    const Coord brick = brickOf(voxel);
    if (brick != lastBrick_) {
      lastBrick_ = brick;
      last_ = index_.find(brick);
    }
    if (last_ == BrickIndex::kNone) return {model_.vacantCode, false};
    const int v = voxelOffset(localOf(voxel));
    return {layer_.codes[last_ * std::size_t(kBrickVoxels) + std::size_t(v)],
            layer_.active[last_].test(v)};
  }

  const VoxelModel& model_;
  const VoxelLayer& layer_;
  const BrickIndex& index_;
  Coord lastBrick_{Box::kMin, 0, 0};
  std::uint32_t last_ = BrickIndex::kNone;
};

// Numbers of contexts. The image of a voxel is missing, inactive or active. For vacancy it is
// missing, or has one of four combinations of activity and code.
constexpr std::size_t kActivities = 128, kImages = 3;
constexpr std::size_t kVacancies = 5;
constexpr int kClassBits = 4;
constexpr std::size_t kClasses = std::size_t{1} << kClassBits;

template <class Side>
class VoxelCoder {
 public:
  /// \param thrift  if not null, codes are chosen; otherwise the layer's are coded
  VoxelCoder(Side& side, const VoxelModel& model, VoxelLayer& layer, const Thrift* thrift = nullptr)
      : side_(side),
        model_(model),
        layer_(layer),
        index_(layer.bricks),
        mirrors_(model, layer, index_),
        thrift_(thrift) {}

  void brick(std::size_t b) {
    halo_.fill(layer_, index_, b, model_.vacantCode);
    for (int v = 0; v < kBrickVoxels; ++v) {
      at_ = b * kBrickVoxels + std::size_t(v);
      voxel(b, v);
    }
  }

 private:
  void voxel(std::size_t b, int v) {
    const auto cell = std::size_t(Halo::cell(voxelLocal(v)));
    const auto image = mirrors_.imageOf(layer_.bricks[b] * kBrickSide + voxelLocal(v));
    std::int32_t& code = layer_.codes[at_];
    const bool active = codeActive(int(cell), image, layer_.active[b].test(v));
    if (active) layer_.active[b].set(v);
    const bool vacant = !active && codeVacant(image, layer_.vacant[b].test(v));
    if (vacant) layer_.vacant[b].set(v);
    code = vacant ? model_.vacantCode : codeValue(int(cell), image, code);
    halo_.code[cell] = code;
    halo_.active[cell] = active;
  }

  bool codeActive(int cell, const std::optional<Image>& image, bool active) {
    const std::size_t state = image ? (image->active ? 2u : 1u) : 0u;
    return side_.bit(active_[halo_.activityAround(cell)][state], active);
  }

  bool codeVacant(const std::optional<Image>& image, bool vacant) {
    std::size_t state = 0;
    if (image)
      state = 1u + 2u * std::size_t(image->active) + std::size_t(image->code == model_.vacantCode);
    return side_.bit(vacant_[state], vacant);
  }

  std::int32_t codeValue(int cell, const std::optional<Image>& image, std::int32_t written) {
    if (!model_.common.empty())
      if (const std::uint32_t known = codeClass(cell, image, written); known > 0)
        return model_.common[known - 1];
    return codeDistance(cell, image, written);
  }

  /// The number of a common code, counted from 1; 0 for all other codes.
  [[nodiscard]] std::uint32_t classOf(std::int32_t code) const {
    const auto it = std::find(model_.common.begin(), model_.common.end(), code);
    return it == model_.common.end() ? 0u : std::uint32_t(it - model_.common.begin()) + 1u;
  }

  std::uint32_t codeClass(int cell, const std::optional<Image>& image, std::int32_t written) {
    auto& model = image ? imageClasses_[classOf(image->code)] : classes_[classesAround(cell)];
    const std::uint32_t coded = model.code(side_, classOf(written));
    if (coded > model_.common.size()) throw BadInput("a voxel is none of the common ones");
    return coded;
  }

  [[nodiscard]] std::size_t classesAround(int cell) const {
    std::size_t classes = 0;
    for (const int back : {Halo::kStepX, Halo::kStepY, Halo::kStepZ})
      classes = classes * kClasses + classOf(halo_.code[std::size_t(cell - back)]);
    return classes;
  }

  std::int32_t codeDistance(int cell, const std::optional<Image>& image, std::int32_t written) {
    predictor_.look(&halo_.code[std::size_t(cell)],
                    image ? std::optional(image->code) : std::nullopt);
    const std::size_t context = predictor_.context();
    if (thrift_) written = thriftyCode(context, written);
    const std::int64_t difference = std::int64_t(written) - predictor_.guess();
    const std::uint64_t magnitude =
        magnitudes_[context].code(side_, std::uint64_t(std::abs(difference)));
    if (magnitude > kMaxDifference) throw BadInput("a voxel is further off than can be");
    const bool negative =
        magnitude != 0 && side_.bit(sign_[context][lastNegative_], difference < 0);
    if (magnitude != 0) lastNegative_ = negative;
    const auto coded = std::int64_t(magnitude);
    const std::int64_t result = predictor_.guess() + (negative ? -coded : coded);
    if (result != std::int32_t(result)) throw BadInput("a voxel does not fit 32 bits");
    predictor_.learn(result);
    return std::int32_t(result);
  }

  /// The code with the least sum of squared error and price of bits: the nearest one, the next one
  /// towards the prediction, or the prediction itself if it is near.
  std::int32_t thriftyCode(std::size_t context, std::int32_t nearest) {
    const std::int64_t guess = predictor_.guess();
    if (guess == nearest) return nearest;
    const std::int32_t step = guess > nearest ? 1 : -1;
    double least = costOf(context, nearest);
    std::int32_t best = nearest;
    for (int n = 1; n <= Thrift::kMaxSteps && nearest + (n - 1) * step != guess; ++n) {
      const std::int32_t code = nearest + n * step;
      const double cost = costOf(context, code);
      if (cost < least) least = cost, best = code;
    }
    return best;
  }

  double costOf(std::size_t context, std::int32_t code) {
    const double error = thrift_->exact[at_] - double(code);
    const std::int64_t difference = std::int64_t(code) - predictor_.guess();
    BitMeter meter;
    (void)magnitudes_[context].code(meter, std::uint64_t(std::abs(difference)));
    if (difference != 0) (void)meter.bit(sign_[context][lastNegative_], difference < 0);
    return error * error + thrift_->bitPrice * meter.bits;
  }

  /// Largest distance of a code from its prediction, which is a sum of at most seven codes.
  static constexpr std::uint64_t kMaxDifference = std::uint64_t{1} << 35;

  Side& side_;
  const VoxelModel& model_;
  VoxelLayer& layer_;
  BrickIndex index_;
  Mirrors mirrors_;
  Halo halo_{};
  VoxelPredictor predictor_;
  const Thrift* thrift_;
  std::size_t at_ = 0;  ///< index of the voxel in the layer's codes
  bool lastNegative_ = false;
  std::array<std::array<BitModel, kImages>, kActivities> active_;
  std::array<BitModel, kVacancies> vacant_;
  std::array<TreeModel<kClassBits>, kClasses * kClasses * kClasses> classes_;
  std::array<TreeModel<kClassBits>, kClasses> imageClasses_;
  std::array<std::array<BitModel, 2>, VoxelPredictor::kContexts> sign_;
  std::array<NumberModelOf<6>, VoxelPredictor::kContexts> magnitudes_;
};

template <class Side>
void code(Side& side, std::span<const std::size_t> order, const VoxelModel& model,
          VoxelLayer& layer) {
  const auto coder = std::make_unique<VoxelCoder<Side>>(side, model, layer);
  for (const std::size_t b : order) coder->brick(b);
}

}  // namespace

void codeVoxels(Writer& side, std::span<const std::size_t> order, const VoxelModel& model,
                VoxelLayer& layer) {
  code(side, order, model, layer);
}
void chooseCodes(std::span<const std::size_t> order, const VoxelModel& model, const Thrift& thrift,
                 VoxelLayer& layer) {
  Writer writer;
  const auto coder = std::make_unique<VoxelCoder<Writer>>(writer, model, layer, &thrift);
  for (const std::size_t b : order) coder->brick(b);
}

void codeVoxels(Reader& side, std::span<const std::size_t> order, const VoxelModel& model,
                VoxelLayer& layer) {
  code(side, order, model, layer);
}

}  // namespace esvr::codec
