// The coder of voxels: what a block may look at, copies of bricks, predictions, and the decisions for one voxel after
// the other. The same code writes, reads and chooses codes.

#include "codec/voxel_coder.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <limits>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "codec/brick_coder.h"
#include "core/brick_index.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "esvr/error.h"

namespace esvr::codec {
namespace {

// ---- Blocks

/// Most bricks of a block, which have 2^20 voxels. Smaller blocks learn their models less well
/// (docs/lab-notes.md, "Blocks of voxels").
constexpr std::uint64_t kBlockBricks = 2048;

/// The bricks of a layer in coding order, the Morton order, in which no brick comes before one that
/// is lower along every axis. A block is a run of them.
class Blocks {
 public:
  Blocks(const std::vector<Coord>& bricks, const VoxelModel& model)
      : index_(bricks),
        order_(codingOrder(bricks)),
        count_(std::size_t(blockCount(bricks.size(), model))),
        blockOf_(count_ > 1 ? bricks.size() : 0) {
    if (count_ == 1) return;
    for (std::size_t n = 0; n < count_; ++n)
      for (const std::size_t b : (*this)[n]) blockOf_[b] = std::uint32_t(n);
  }

  [[nodiscard]] std::size_t size() const { return count_; }
  /// The bricks of a block, in coding order.
  [[nodiscard]] std::span<const std::size_t> operator[](std::size_t n) const {
    const auto from = [&](std::size_t k) { return order_.size() * k / count_; };
    return std::span(order_).subspan(from(n), from(n + 1) - from(n));
  }
  /// Position of a brick among those of the layer, or BrickIndex::kNone if the block has it not.
  [[nodiscard]] std::uint32_t find(Coord brick, std::size_t block) const {
    const std::uint32_t found = index_.find(brick);
    const bool own = count_ == 1 || found == BrickIndex::kNone || blockOf_[found] == block;
    return own ? found : BrickIndex::kNone;
  }

 private:
  BrickIndex index_;
  std::vector<std::size_t> order_;
  std::size_t count_;
  std::vector<std::uint32_t> blockOf_;  ///< by brick; empty if there is only one block
};

/// The bricks that the coder of a block may look at.
struct OwnBricks {
  const Blocks& blocks;
  std::size_t block;

  [[nodiscard]] std::uint32_t find(Coord brick) const { return blocks.find(brick, block); }
};

// ---- Mirror images

/// The mirror image of a voxel, if it was coded before the voxel.
struct Image {
  std::int32_t code = 0;
  bool active = false;
  bool vacant = false;
};

/// Finds the image of a voxel, along the first axis on which an image lies before it.
class Mirrors {
 public:
  Mirrors(const VoxelModel& model, const VoxelLayer& layer, const OwnBricks& bricks)
      : model_(model), layer_(layer), bricks_(bricks), any_(hasMirror(model)) {}

  /// True if the model has a mirror.
  [[nodiscard]] bool any() const { return any_; }

  [[nodiscard]] std::optional<Image> imageOf(Coord voxel) {
    if (!any_) return std::nullopt;
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
      last_ = bricks_.find(brick);
    }
    if (last_ == BrickIndex::kNone) return {model_.vacantCode, false, true};
    const int v = voxelOffset(localOf(voxel));
    return {layer_.codes[last_ * std::size_t(kBrickVoxels) + std::size_t(v)],
            layer_.active[last_].test(v), layer_.vacant[last_].test(v)};
  }

  const VoxelModel& model_;
  const VoxelLayer& layer_;
  const OwnBricks& bricks_;
  Coord lastBrick_{Box::kMin, 0, 0};
  std::uint32_t last_ = BrickIndex::kNone;
  bool any_;
};

// ---- Copies

/// The source of a copy is a number: 0, 1 and 2 are the neighbours along x, y and z, and this one
/// stands for the mirror images.
constexpr std::uint32_t kImageSource = 3;
constexpr int kSourceBits = 2;

/// Finds and makes copies. A brick is a copy if all its voxels equal voxels that are coded before
/// them: those of the neighbouring brick along an axis, or their mirror images. If the neighbouring
/// brick or a mirror image does not exist, vacant voxels take its place.
/// \tparam Layer  as that of VoxelCoder
template <class Layer>
class BrickCopies {
 public:
  BrickCopies(const VoxelModel& model, Layer& layer, const OwnBricks& bricks, Mirrors& mirrors)
      : model_(model), layer_(layer), bricks_(bricks), mirrors_(mirrors) {}

  /// The first source whose voxels equal those of brick b; nothing if there is none.
  [[nodiscard]] std::optional<std::uint32_t> sourceOf(std::size_t b) {
    for (std::uint32_t axis = 0; axis < kImageSource; ++axis)
      if (equals(b, before(b, axis))) return axis;
    return mirrors_.any() && equalsImages(b) ? std::optional(kImageSource) : std::nullopt;
  }

  /// Sets the voxels of brick b, which must have no active and no vacant voxel yet.
  void copy(std::size_t b, std::uint32_t source) {
    if (source == kImageSource) return copyImages(b);
    copyBrick(b, before(b, source));
  }

  /// The brick before brick b along an axis, or BrickIndex::kNone.
  [[nodiscard]] std::uint32_t before(std::size_t b, std::uint32_t axis) const {
    Coord brick = layer_.bricks[b];
    --(brick.*kAxes[axis]);
    return bricks_.find(brick);
  }

 private:
  [[nodiscard]] auto codesOf(std::size_t b) const {
    return layer_.codes.begin() + std::ptrdiff_t(b * kBrickVoxels);
  }

  [[nodiscard]] bool equals(std::size_t b, std::uint32_t other) const {
    if (other == BrickIndex::kNone) return layer_.vacant[b].count() == kBrickVoxels;
    return layer_.active[b] == layer_.active[other] && layer_.vacant[b] == layer_.vacant[other] &&
           std::equal(codesOf(b), codesOf(b) + kBrickVoxels, codesOf(other));
  }

  void copyBrick(std::size_t b, std::uint32_t other) {
    if (other == BrickIndex::kNone) {
      layer_.vacant[b].setAll();
      std::fill_n(codesOf(b), kBrickVoxels, model_.vacantCode);
      return;
    }
    layer_.active[b] = layer_.active[other];
    layer_.vacant[b] = layer_.vacant[other];
    std::copy_n(codesOf(other), kBrickVoxels, codesOf(b));
  }

  /// The image of voxel v of a brick, or a vacant voxel.
  [[nodiscard]] Image imageOf(std::size_t b, int v) {
    const auto image = mirrors_.imageOf(layer_.bricks[b] * kBrickSide + voxelLocal(v));
    return image.value_or(Image{model_.vacantCode, false, true});
  }

  [[nodiscard]] bool equalsImages(std::size_t b) {
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Image image = imageOf(b, v);
      if (image.active != layer_.active[b].test(v) || image.vacant != layer_.vacant[b].test(v) ||
          image.code != codesOf(b)[v])
        return false;
    }
    return true;
  }

  void copyImages(std::size_t b) {
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Image image = imageOf(b, v);
      codesOf(b)[v] = image.code;
      if (image.active) layer_.active[b].set(v);
      if (image.vacant) layer_.vacant[b].set(v);
    }
  }

  const VoxelModel& model_;
  Layer& layer_;
  const OwnBricks& bricks_;
  Mirrors& mirrors_;
};

// ---- Predictions

/// Predicts the code of a voxel from the voxels before it and from its mirror image. Of several
/// predictions it takes the one with the smallest recent error. Only integers are used
/// (docs/format.md, "Voxels").
class VoxelPredictor {
 public:
  static constexpr std::size_t kAroundContexts = 80, kImageContexts = 31;
  static constexpr std::size_t kContexts = kAroundContexts + kImageContexts;

  /// Computes the predictions for a voxel.
  /// \param at     the voxel in the codes of a halo
  /// \param image  code of the voxel's mirror image, if it has one
  void look(const std::int32_t* at, std::optional<std::int32_t> image) {
    constexpr int kX = Halo::kStepX, kY = Halo::kStepY, kZ = Halo::kStepZ;
    const std::int64_t a = at[-kX], b = at[-kY], c = at[-kZ], ab = at[-kX - kY], ac = at[-kX - kZ],
                       bc = at[-kY - kZ], abc = at[-kX - kY - kZ];
    const std::int64_t low = std::min({a, b, c}), high = std::max({a, b, c});
    const std::int64_t lorenzo = a + b + c - ab - ac - bc + abc;
    guesses_ = {image.value_or(0),
                std::clamp(lorenzo, low, high),
                (a + b + c) / 3,
                (2 * (a + b + c) - ab - ac - bc) / 3,
                c + (b - bc + a - ac) / 2,
                lorenzo,
                c};
    spread_ = std::abs(a - ab) + std::abs(b - bc) + std::abs(c - ac) + std::abs(a - ac) +
              std::abs(b - ab) + std::abs(c - bc);
    first_ = image ? kImage : kImage + 1;
    best_ = leastError();
  }

  [[nodiscard]] std::int64_t guess() const { return guesses_[best_]; }

  /// The context of the prediction's error. For the mirror image it is the number of bits of its
  /// recent errors; otherwise it is the magnitude, in half octaves, of the differences between the
  /// surrounding voxels plus recent errors.
  [[nodiscard]] std::size_t context() const {
    const std::uint64_t late = errors_[best_];
    if (best_ == kImage)
      return kAroundContexts +
             std::min<std::size_t>(std::size_t(std::bit_width(late / 4)), kImageContexts - 1);
    const std::uint64_t around = std::uint64_t(spread_) + late / 64;
    const int width = int(std::bit_width(around));
    const bool upper = width > 1 && ((around >> (width - 2)) & 1u) != 0;
    return std::min(std::size_t(2 * width + (upper ? 1 : 0)), kAroundContexts - 1);
  }

  void learn(std::int64_t code) {
    for (std::size_t k = first_; k < kGuesses; ++k)
      errors_[k] += kUnit * std::min(std::uint64_t(std::abs(code - guesses_[k])), kMaxError) -
                    errors_[k] / kMemory;
  }

 private:
  static constexpr std::size_t kGuesses = 7, kImage = 0;
  static constexpr int kGuessBits = 3;
  static constexpr std::uint64_t kUnit = 16;    // errors are counted in units of 1/16
  static constexpr std::uint64_t kMemory = 16;  // recent errors decay by 1/16 for each voxel
  static constexpr std::uint64_t kMaxError = std::uint64_t{1} << 34;

  /// The existing prediction with the least error, the first one among equals. The index is in the
  /// lowest bits of what is compared, so that no branch depends on the errors, which no processor
  /// could foresee. An error stays below 2^43.
  [[nodiscard]] std::size_t leastError() const {
    std::uint64_t least = ~std::uint64_t{0};
    for (std::size_t k = 0; k < kGuesses; ++k) {
      const std::uint64_t now = errors_[k] << kGuessBits | k;
      least = k >= first_ && now < least ? now : least;
    }
    return least & ((std::size_t{1} << kGuessBits) - 1);
  }

  std::array<std::int64_t, kGuesses> guesses_{};
  std::array<std::uint64_t, kGuesses> errors_{};
  std::int64_t spread_ = 0;
  std::size_t first_ = 0;  ///< index of the first prediction that exists
  std::size_t best_ = 0;
};

// ---- Voxels

// Numbers of contexts. The image of a voxel is missing, inactive or active. For vacancy it is
// missing, or has one of four combinations of activity and code.
constexpr std::size_t kActivities = 128, kImages = 3;
constexpr std::size_t kVacancies = 5;
constexpr std::size_t kCopyStates = 8;  // each of the three bricks before is a copy or not
constexpr int kClassBits = 4;
constexpr std::size_t kClasses = std::size_t{1} << kClassBits;

/// Codes the bricks of a block. In a brick that is not a copy, each voxel is predicted from the voxels
/// before it and from its mirror image; the contexts depend on the errors of recent predictions.
/// \tparam Side   Writer or Reader
/// \tparam Layer  const VoxelLayer if its codes are written; VoxelLayer if they are read or chosen
template <class Side, class Layer>
class VoxelCoder {
 public:
  /// \param isCopy  by brick of the layer; the coder sets those of its block
  /// \param thrift  if not null, codes are chosen; otherwise the layer's are coded
  VoxelCoder(const VoxelModel& model, const OwnBricks& bricks, std::vector<std::uint8_t>& isCopy,
             Layer& layer, const Thrift* thrift = nullptr)
      : model_(model),
        layer_(layer),
        bricks_(bricks),
        mirrors_(model, layer, bricks_),
        copies_(model, layer, bricks_, mirrors_),
        isCopy_(isCopy),
        vacantClass_(std::uint8_t(classOf(model.vacantCode))),
        thrift_(thrift) {}

  /// The side is an argument and not a member, so that the compiler can keep the state of a range
  /// decoder in registers.
  void brick(Side& side, std::size_t b) {
    if (codeCopy(side, b)) return;
    halo_.fill(layer_, bricks_, b, model_.vacantCode);
    fillClasses();
    for (int first = 0; first < kBrickVoxels; first += kBrickSide) line(side, b, first);
  }

 private:
  /// Codes whether a brick is a copy and, if it is, the source. \return whether it is a copy
  bool codeCopy(Side& side, std::size_t b) {
    const auto wanted = kReads ? std::nullopt : copies_.sourceOf(b);
    const bool isCopy = side.bit(copy_[copiesBefore(b)], wanted.has_value());
    isCopy_[b] = isCopy;
    if (!isCopy) return false;
    lastSource_ = sources_[lastSource_].code(side, wanted.value_or(0));
    if constexpr (kReads) copies_.copy(b, lastSource_);
    return true;
  }

  /// Three bits, from the highest to the lowest: whether the bricks before brick b along x, y and z
  /// are copies.
  [[nodiscard]] std::size_t copiesBefore(std::size_t b) const {
    std::size_t bits = 0;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t before = copies_.before(b, axis);
      bits = bits << 1 | std::size_t(before != BrickIndex::kNone && isCopy_[before] != 0);
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
    const bool active = codeActive(side, around, image, layer_.active[b].test(v));
    const bool vacant = !active && codeVacant(side, image, layer_.vacant[b].test(v));
    std::int32_t code = model_.vacantCode;
    if (vacant)
      class_[cell] = vacantClass_;
    else
      code = codeValue(side, int(cell), image, layer_.codes[at_]);
    if constexpr (!std::is_const_v<Layer>) {
      layer_.codes[at_] = code;
      if (active) layer_.active[b].set(v);
      if (vacant) layer_.vacant[b].set(v);
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
  Layer& layer_;
  OwnBricks bricks_;
  Mirrors mirrors_;
  BrickCopies<Layer> copies_;
  std::vector<std::uint8_t>& isCopy_;
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
  std::array<TreeModel<kSourceBits>, std::size_t{1} << kSourceBits> sources_;
  std::array<std::array<BitModel, kImages>, kActivities> active_;
  std::array<BitModel, kVacancies> vacant_;
  std::array<TreeModel<kClassBits>, kClasses * kClasses * kClasses> classes_;
  std::array<TreeModel<kClassBits>, kClasses> imageClasses_;
  std::array<std::array<BitModel, 2>, VoxelPredictor::kContexts> sign_;
  std::array<NumberModelOf<6>, VoxelPredictor::kContexts> magnitudes_;
};

/// The codes of a block, which are written or chosen.
/// \param mostBytes  the work stops after the brick with which there are more
template <class Layer>
CodedPart codeBlock(Writer& writer, const VoxelModel& model, const OwnBricks& bricks,
                    std::vector<std::uint8_t>& isCopy, Layer& layer, const Thrift* thrift = nullptr,
                    std::uint64_t mostBytes = std::numeric_limits<std::uint64_t>::max()) {
  const auto coder =
      std::make_unique<VoxelCoder<Writer, Layer>>(model, bricks, isCopy, layer, thrift);
  const auto order = bricks.blocks[bricks.block];
  CodedPart part;
  while (part.bricks < order.size() && part.bytes <= mostBytes) {
    throwIfCancelled();
    coder->brick(writer, order[part.bricks++]);
    part.bytes = writer.coder.size();
  }
  return part;
}

/// Codes blocks until they exceed a limit. So that the result does not depend on the number of
/// threads, the limit is looked at after every kBlocksAtOnce blocks.
template <class Layer>
CodedPart codeUpTo(std::uint64_t mostBytes, const VoxelModel& model, const Thrift* thrift,
                   Layer& layer) {
  constexpr std::size_t kBlocksAtOnce = 16;
  const Blocks blocks(layer.bricks, model);
  std::vector<std::uint8_t> isCopy(layer.bricks.size());
  std::vector<CodedPart> parts(blocks.size());
  CodedPart sum;
  for (std::size_t n = 0; n < blocks.size() && sum.bytes <= mostBytes; n += kBlocksAtOnce) {
    const std::size_t end = std::min(n + kBlocksAtOnce, blocks.size());
    parallelFor(n, end, [&](std::size_t block) {
      Writer writer;
      parts[block] = codeBlock(writer, model, {blocks, block}, isCopy, layer, thrift, mostBytes);
    });
    for (std::size_t block = n; block < end; ++block)
      sum = {sum.bytes + parts[block].bytes, sum.bricks + parts[block].bricks};
  }
  return sum;
}

}  // namespace

std::uint64_t blockCount(std::uint64_t bricks, const VoxelModel& model) {
  if (hasMirror(model) || bricks == 0) return 1;
  return (bricks + kBlockBricks - 1) / kBlockBricks;
}

std::vector<Stream> encodeVoxels(Writer first, const VoxelModel& model, const VoxelLayer& layer) {
  const Blocks blocks(layer.bricks, model);
  std::vector<std::uint8_t> isCopy(layer.bricks.size());
  std::vector<Stream> streams(blocks.size());
  parallelFor(std::size_t{0}, blocks.size(), [&](std::size_t block) {
    Writer writer;
    if (block == 0) writer = std::move(first);
    (void)codeBlock(writer, model, {blocks, block}, isCopy, layer);
    streams[block] = writer.coder.finish();
  });
  return streams;
}

void decodeVoxels(const Reader& first, std::span<const StreamView> others, const VoxelModel& model,
                  VoxelLayer& layer) {
  const Blocks blocks(layer.bricks, model);
  std::vector<std::uint8_t> isCopy(layer.bricks.size());
  parallelFor(std::size_t{0}, blocks.size(), [&](std::size_t block) {
    Reader reader = block == 0 ? first : Reader{RangeDecoder(others[block - 1])};
    const OwnBricks own{blocks, block};
    const auto coder = std::make_unique<VoxelCoder<Reader, VoxelLayer>>(model, own, isCopy, layer);
    for (const std::size_t b : blocks[block]) {
      throwIfCancelled();
      coder->brick(reader, b);
    }
  });
}

CodedPart chooseCodes(const VoxelModel& model, const Thrift& thrift, std::uint64_t mostBytes,
                      VoxelLayer& layer) {
  return codeUpTo(mostBytes, model, &thrift, layer);
}

CodedPart codeWithin(const VoxelModel& model, std::uint64_t mostBytes, const VoxelLayer& layer) {
  return codeUpTo(mostBytes, model, nullptr, layer);
}

}  // namespace esvr::codec
