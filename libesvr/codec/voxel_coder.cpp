#include "codec/voxel_coder.h"

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <optional>
#include <type_traits>

#include "codec/brick_copies.h"
#include "codec/voxel_mirrors.h"
#include "codec/voxel_predictor.h"
#include "core/parallel.h"
#include "esvr/error.h"

namespace esvr::codec {
namespace {

// Numbers of contexts. The image of a voxel is missing, inactive or active. For vacancy it is
// missing, or has one of four combinations of activity and code.
constexpr std::size_t kActivities = 128, kImages = 3;
constexpr std::size_t kVacancies = 5;
constexpr std::size_t kCopyStates = 8;  // each of the three bricks before is a copy or not
constexpr int kClassBits = 4;
constexpr std::size_t kClasses = std::size_t{1} << kClassBits;

template <class Side>
class VoxelCoder {
 public:
  /// \param thrift  if not null, codes are chosen; otherwise the layer's are coded
  VoxelCoder(const VoxelModel& model, VoxelLayer& layer, const Thrift* thrift = nullptr)
      : model_(model),
        layer_(layer),
        index_(layer.bricks),
        mirrors_(model, layer, index_),
        copies_(model, layer, index_, mirrors_),
        isCopy_(layer.bricks.size()),
        vacantClass_(std::uint8_t(classOf(model.vacantCode))),
        thrift_(thrift) {}

  /// The side is an argument and not a member, so that the compiler can keep the state of a range
  /// decoder in registers.
  void brick(Side& side, std::size_t b) {
    if (codeCopy(side, b)) return;
    halo_.fill(layer_, index_, b, model_.vacantCode);
    fillClasses();
    for (int first = 0; first < kBrickVoxels; first += kBrickSide) line(side, b, first);
  }

 private:
  /// Codes whether a brick is a copy and, if it is, the source. \return whether it is a copy
  bool codeCopy(Side& side, std::size_t b) {
    const auto wanted = kReads ? std::nullopt : copies_.sourceOf(b);
    isCopy_[b] = side.bit(copy_[copiesBefore(b)], wanted.has_value());
    if (!isCopy_[b]) return false;
    lastSource_ = sources_[lastSource_].code(side, wanted.value_or(0));
    if (kReads) copies_.copy(b, lastSource_);
    return true;
  }

  /// Three bits, from the highest to the lowest: whether the bricks before brick b along x, y and z
  /// are copies.
  [[nodiscard]] std::size_t copiesBefore(std::size_t b) const {
    std::size_t bits = 0;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t before = copies_.before(b, axis);
      bits = bits << 1 | std::size_t(before != BrickIndex::kNone && isCopy_[before]);
    }
    return bits;
  }

  /// Codes the voxels of a line along z.
  void line(Side& side, std::size_t b, int first) {
    const int cell = Halo::cell(voxelLocal(first));
    std::size_t around = halo_.activityAround(cell);
    for (int z = 0; z < kBrickSide; ++z) {
      at_ = b * kBrickVoxels + std::size_t(first + z);
      const bool active = voxel(side, {b, first + z}, around);
      if (z + 1 < kBrickSide) around = halo_.activityAfter(around, active, cell + z + 1);
    }
  }

  struct Place {
    std::size_t brick;
    int offset;
  };

  /// \param around  Halo::activityAround()
  /// \return whether the voxel is active
  bool voxel(Side& side, const Place& place, std::size_t around) {
    const auto [b, v] = place;
    const auto cell = std::size_t(Halo::cell(voxelLocal(v)));
    const auto image = mirrors_.imageOf(layer_.bricks[b] * kBrickSide + voxelLocal(v));
    std::int32_t& code = layer_.codes[at_];
    const bool active = codeActive(side, around, image, layer_.active[b].test(v));
    if (active) layer_.active[b].set(v);
    const bool vacant = !active && codeVacant(side, image, layer_.vacant[b].test(v));
    if (vacant) layer_.vacant[b].set(v);
    if (vacant) {
      code = model_.vacantCode;
      class_[cell] = vacantClass_;
    } else {
      code = codeValue(side, int(cell), image, code);
    }
    halo_.code[cell] = code;
    halo_.active[cell] = active;
    return active;
  }

  /// Sets the classes of the voxels before the brick.
  void fillClasses() {
    if (model_.common.empty()) return;
    Halo::forEachBefore([&](std::size_t cell) {
      const std::int32_t code = halo_.code[cell];
      class_[cell] = code == model_.vacantCode ? vacantClass_ : std::uint8_t(classOf(code));
    });
  }

  bool codeActive(Side& side, std::size_t around, const std::optional<Image>& image, bool active) {
    const std::size_t state = image ? (image->active ? 2u : 1u) : 0u;
    return side.bit(active_[around][state], active);
  }

  bool codeVacant(Side& side, const std::optional<Image>& image, bool vacant) {
    std::size_t state = 0;
    if (image)
      state = 1u + 2u * std::size_t(image->active) + std::size_t(image->code == model_.vacantCode);
    return side.bit(vacant_[state], vacant);
  }

  std::int32_t codeValue(Side& side, int cell, const std::optional<Image>& image,
                         std::int32_t written) {
    if (!model_.common.empty()) {
      const std::uint32_t known = codeClass(side, cell, image, written);
      class_[std::size_t(cell)] = std::uint8_t(known);
      if (known > 0) return model_.common[known - 1];
    }
    return codeDistance(side, cell, image, written);
  }

  /// The number of a common code, counted from 1; 0 for all other codes.
  [[nodiscard]] std::uint32_t classOf(std::int32_t code) const {
    const auto it = std::find(model_.common.begin(), model_.common.end(), code);
    return it == model_.common.end() ? 0u : std::uint32_t(it - model_.common.begin()) + 1u;
  }

  std::uint32_t codeClass(Side& side, int cell, const std::optional<Image>& image,
                          std::int32_t written) {
    auto& model = image ? imageClasses_[classOf(image->code)] : classes_[classesAround(cell)];
    const std::uint32_t coded = model.code(side, kReads ? 0u : classOf(written));
    if (coded > model_.common.size()) throw BadInput("a voxel is none of the common ones");
    return coded;
  }

  [[nodiscard]] std::size_t classesAround(int cell) const {
    std::size_t classes = 0;
    for (const int back : {Halo::kStepX, Halo::kStepY, Halo::kStepZ})
      classes = classes * kClasses + class_[std::size_t(cell - back)];
    return classes;
  }

  std::int32_t codeDistance(Side& side, int cell, const std::optional<Image>& image,
                            std::int32_t written) {
    predictor_.look(&halo_.code[std::size_t(cell)],
                    image ? std::optional(image->code) : std::nullopt);
    const std::size_t context = predictor_.context();
    if (thrift_) written = thriftyCode(context, written);
    const std::int64_t difference = std::int64_t(written) - predictor_.guess();
    const std::uint64_t magnitude =
        magnitudes_[context].code(side, std::uint64_t(std::abs(difference)));
    if (magnitude > kMaxDifference) throw BadInput("a voxel is further off than can be");
    const bool negative = magnitude != 0 && side.bit(sign_[context][lastNegative_], difference < 0);
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
      if (thrift_->signs == RoundedSigns::kKept && (code < 0) != (nearest < 0)) break;
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

  static constexpr bool kReads = std::is_same_v<Side, Reader>;

  const VoxelModel& model_;
  VoxelLayer& layer_;
  BrickIndex index_;
  Mirrors mirrors_;
  BrickCopies copies_;
  std::vector<bool> isCopy_;      ///< by brick
  std::uint32_t lastSource_ = 0;  ///< source of the latest brick that was a copy
  Halo halo_{};
  /// The numbers of the codes in the halo (classOf), if there are common codes.
  std::array<std::uint8_t, Halo::kCells> class_{};
  std::uint8_t vacantClass_;
  VoxelPredictor predictor_;
  const Thrift* thrift_;
  std::size_t at_ = 0;  ///< index of the voxel in the layer's codes
  bool lastNegative_ = false;
  std::array<BitModel, kCopyStates> copy_;
  std::array<TreeModel<BrickCopies::kSourceBits>, std::size_t{1} << BrickCopies::kSourceBits>
      sources_;
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
  const auto coder = std::make_unique<VoxelCoder<Side>>(model, layer);
  for (const std::size_t b : order) {
    throwIfCancelled();
    coder->brick(side, b);
  }
}

CodedPart codePart(std::span<const std::size_t> order, const VoxelModel& model,
                   const Thrift* thrift, std::uint64_t mostBytes, VoxelLayer& layer) {
  Writer writer;
  const auto coder = std::make_unique<VoxelCoder<Writer>>(model, layer, thrift);
  CodedPart part;
  while (part.bricks < order.size() && part.bytes <= mostBytes) {
    throwIfCancelled();
    coder->brick(writer, order[part.bricks++]);
    part.bytes = writer.coder.size();
  }
  return part;
}

}  // namespace

void codeVoxels(Writer& side, std::span<const std::size_t> order, const VoxelModel& model,
                VoxelLayer& layer) {
  code(side, order, model, layer);
}

CodedPart chooseCodes(std::span<const std::size_t> order, const VoxelModel& model,
                      const Thrift& thrift, std::uint64_t mostBytes, VoxelLayer& layer) {
  return codePart(order, model, &thrift, mostBytes, layer);
}

CodedPart codeWithin(std::span<const std::size_t> order, const VoxelModel& model,
                     std::uint64_t mostBytes, const VoxelLayer& layer) {
  VoxelLayer written = layer;  // a coder without thrift writes the codes that are there
  return codePart(order, model, nullptr, mostBytes, written);
}

void codeVoxels(Reader& side, std::span<const std::size_t> order, const VoxelModel& model,
                VoxelLayer& layer) {
  Reader local = side;
  code(local, order, model, layer);
  side = local;
}

}  // namespace esvr::codec
