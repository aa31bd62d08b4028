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
#include "codec/symbol_coder.h"
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

/// Bricks of a part of a stream, without those that are copies. A writer keeps the steps of a part in memory; the state
/// of a part takes 4 bytes more than what it tells.
constexpr std::size_t kPartBricks = 256;

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

/// Finds and makes copies. A brick is a copy if all its voxels equal voxels that are coded before
/// them: those of the neighbouring brick along an axis, or their mirror images. If the neighbouring
/// brick or a mirror image does not exist, vacant voxels take its place.
/// \tparam Layer  as that of VoxelCoder
template <class Layer>
class BrickCopies {
 public:
  BrickCopies(const VoxelModel& model, Layer& layer, Mirrors& mirrors)
      : model_(model), layer_(layer), mirrors_(mirrors) {}

  /// The bricks before a brick along x, y and z, or BrickIndex::kNone.
  using Faces = std::array<std::uint32_t, kImageSource>;

  /// The first source whose voxels equal those of brick b; nothing if there is none.
  [[nodiscard]] std::optional<std::uint32_t> sourceOf(std::size_t b, const Faces& faces) {
    for (std::uint32_t axis = 0; axis < kImageSource; ++axis)
      if (equals(b, faces[axis])) return axis;
    return mirrors_.any() && equalsImages(b) ? std::optional(kImageSource) : std::nullopt;
  }

  /// Sets the voxels of brick b, which must have no active and no vacant voxel yet.
  void copy(std::size_t b, const Faces& faces, std::uint32_t source) {
    if (source == kImageSource) return copyImages(b);
    copyBrick(b, faces[source]);
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
  Mirrors& mirrors_;
};

// ---- Predictions

// Codes are added and subtracted modulo 2^32.
std::int32_t plus(std::int32_t a, std::int32_t b) {
  return std::int32_t(std::uint32_t(a) + std::uint32_t(b));
}
std::int32_t minus(std::int32_t a, std::int32_t b) {
  return std::int32_t(std::uint32_t(a) - std::uint32_t(b));
}
/// The magnitude of the difference.
std::uint32_t apart(std::int32_t a, std::int32_t b) {
  const std::int32_t d = minus(a, b), sign = d >> 31;
  return std::uint32_t(d ^ sign) - std::uint32_t(sign);
}

/// A third, about: 21/64, rounded.
std::int32_t thirdOf(std::int32_t n) { return std::int32_t(std::uint32_t(n) * 21u + 32u) >> 6; }
/// Half, rounded towards 0.
std::int32_t halfOf(std::int32_t n) { return minus(n, n >> 31) >> 1; }

/// A line of voxels along z, as the rules of prediction see it (docs/format.md, "Voxels"). What does not depend on the
/// line itself is computed at once for all its voxels.
class PredictedLine {
 public:
  static constexpr std::size_t kRules = 6;

  /// \param at  the first voxel in the codes of a halo
  explicit PredictedLine(const std::int32_t* at)
      : own_(at), beforeX_(at - Halo::kStepX), beforeY_(at - Halo::kStepY) {
    const std::int32_t *ab = beforeX_ - Halo::kStepY, *abc = ab - 1;
    for (int z = 0; z < kBrickSide; ++z) {
      const std::int32_t a = beforeX_[z], b = beforeY_[z], ac = beforeX_[z - 1],
                         bc = beforeY_[z - 1];
      const auto n = std::size_t(z);
      low_[n] = std::min(a, b);
      high_[n] = std::max(a, b);
      pair_[n] = plus(a, b);
      const std::int32_t edges = plus(ab[z], plus(ac, bc));
      corner_[n] = minus(plus(pair_[n], abc[z]), edges);
      slope_[n] = halfOf(minus(pair_[n], plus(ac, bc)));
      faces_[n] = minus(plus(pair_[n], pair_[n]), edges);
      spread_[n] = apart(a, ab[z]) + apart(b, bc) + apart(a, ac) + apart(b, ab[z]);
    }
  }

  /// The prediction of a voxel by a rule.
  /// \param c  the code of the voxel before it along z
  template <std::size_t kRule>
  [[nodiscard]] std::int32_t guess(int z, std::int32_t c) const {
    const auto n = std::size_t(z);
    if constexpr (kRule == 0)
      return std::clamp(plus(c, corner_[n]), std::min(low_[n], c), std::max(high_[n], c));
    if constexpr (kRule == 1) return plus(c, thirdOf(minus(pair_[n], plus(c, c))));
    if constexpr (kRule == 2) return plus(c, thirdOf(minus(faces_[n], c)));
    if constexpr (kRule == 3) return plus(c, slope_[n]);
    if constexpr (kRule == 4) return plus(c, corner_[n]);
    return c;
  }

  /// The sum of the differences between neighbours of a voxel.
  [[nodiscard]] std::uint32_t spread(int z, std::int32_t c) const {
    return spread_[std::size_t(z)] + apart(c, beforeX_[z - 1]) + apart(c, beforeY_[z - 1]);
  }

  /// The sum of a rule's errors, once the codes of the line are known.
  /// \param counts  all bits set for the voxels that count, no bit for the others
  template <std::size_t kRule>
  [[nodiscard]] std::uint32_t errors(const std::array<std::int32_t, kBrickSide>& counts) const {
    constexpr std::int32_t kMaxError = 1 << 20;
    std::int32_t sum = 0;
    for (int z = 0; z < kBrickSide; ++z) {
      const auto error = std::int32_t(apart(own_[z], guess<kRule>(z, own_[z - 1])) & 0x7fffffffu);
      sum += std::min(error, kMaxError) & counts[std::size_t(z)];
    }
    return std::uint32_t(sum);
  }

 private:
  using Numbers = std::array<std::int32_t, kBrickSide>;

  const std::int32_t *own_, *beforeX_, *beforeY_;
  Numbers low_, high_, pair_, corner_, slope_, faces_;
  std::array<std::uint32_t, kBrickSide> spread_;
};

/// The recent errors of the rules of prediction. Those of a line are added when the line is complete, so that no voxel
/// waits for a choice between rules.
class RuleErrors {
 public:
  [[nodiscard]] std::size_t bestRule() const {
    return std::size_t(std::min_element(errors_.begin(), errors_.end()) - errors_.begin());
  }
  [[nodiscard]] std::uint32_t of(std::size_t rule) const { return errors_[rule]; }

  void learn(const PredictedLine& line, const std::array<std::int32_t, kBrickSide>& counts) {
    learn(line, counts, std::make_index_sequence<PredictedLine::kRules>());
  }

 private:
  static constexpr int kFade = 4;  // a line makes errors before it count 1/16 less

  template <std::size_t... kRule>
  void learn(const PredictedLine& line, const std::array<std::int32_t, kBrickSide>& counts,
             std::index_sequence<kRule...>) {
    ((errors_[kRule] += line.errors<kRule>(counts) - (errors_[kRule] >> kFade)), ...);
  }

  std::array<std::uint32_t, PredictedLine::kRules> errors_{};
};

// ---- Differences from predictions

/// Models of differences that have one context. A symbol tells the sign and the number of bits of a difference relative
/// to `base`, which is larger where larger differences are expected. Another symbol has up to 4 bits of the difference,
/// and the bits below these are raw.
struct DifferenceModel {
  static constexpr int kLeadBits = 4;
  static constexpr std::uint32_t kSizes = 7, kEscape = 2 * kSizes + 1;

  explicit DifferenceModel(int expected) : base(expected) {
    for (int size = 1; size <= int(leads.size()); ++size)
      leads[std::size_t(size) - 1] = SymbolModel(1 << std::min(bitsOf(size), kLeadBits));
  }

  /// The size of a difference, which is not 0: 1 for all of up to base + 1 bits, 2 for one more, and so on.
  [[nodiscard]] int sizeOf(std::uint32_t magnitude) const {
    return std::max(int(std::bit_width(magnitude)) - base, 1);
  }
  /// The bits of a difference that follow the symbol of its size. Above size 1, the highest one is known.
  [[nodiscard]] int bitsOf(int size) const {
    return size == 1 ? (base > 0 ? base + 1 : 0) : base + size - 1;
  }
  [[nodiscard]] SymbolModel& leadOf(int size) {
    return leads[std::min(std::size_t(size), leads.size()) - 1];
  }

  /// The number of a difference in the symbols of sizes, if it has one of the sizes up to kSizes.
  [[nodiscard]] std::uint32_t symbolOf(std::int32_t difference) const {
    if (difference == 0) return 0;
    const int size = sizeOf(apart(difference, 0));
    return size > int(kSizes) ? kEscape : std::uint32_t(2 * size) - (difference < 0 ? 0u : 1u);
  }

  int base;
  SymbolModel sizes;  ///< 0; then +1, -1, +2, -2, ... for sizes; kEscape for larger ones
  std::array<SymbolModel, kSizes + 1> leads;  ///< by size; the last one is for all larger ones
};

/// Codes differences. The models of large ones are shared.
class VoxelDifferences {
 public:
  template <class Side>
  [[gnu::always_inline]] std::int32_t code(Side& side, DifferenceModel& model,
                                           std::int32_t difference) {
    const std::uint32_t symbol = side.symbol(model.sizes, model.symbolOf(difference));
    // The order of the symbols is 0, 1, -1 where a size is a number.
    if (symbol <= (model.base > 0 ? 0u : 2u))
      return std::int32_t(symbol & 1u) - std::int32_t(symbol >> 1);
    if (symbol == DifferenceModel::kEscape) return codeLarge(side, model, difference);
    const std::uint32_t magnitude =
        codeBits(side, model, int(symbol + 1) / 2, apart(difference, 0));
    return std::int32_t((symbol & 1u) != 0 ? magnitude : 0u - magnitude);
  }

  /// The price of a difference, without that of the rare sizes.
  [[nodiscard]] static std::uint32_t priceOf(DifferenceModel& model, std::int32_t difference) {
    const std::uint32_t symbol = model.symbolOf(difference), magnitude = apart(difference, 0);
    const std::uint32_t price = BitPrices::of(model.sizes.of(symbol).share);
    if (symbol == 0) return price;
    const int size = model.sizeOf(magnitude), bits = model.bitsOf(size);
    if (bits == 0) return price;
    const int below = std::max(bits - DifferenceModel::kLeadBits, 0);
    const std::uint32_t lead = (magnitude >> below) & ((1u << (bits - below)) - 1u);
    return price + BitPrices::of(model.leadOf(size).of(lead).share) +
           (std::uint32_t(below) << BitPrices::kFractionBits);
  }

 private:
  template <class Side>
  [[gnu::noinline]] std::int32_t codeLarge(Side& side, DifferenceModel& model,
                                           std::int32_t difference) {
    constexpr std::uint32_t kLast = SymbolModel::kSymbols - 1;
    constexpr int kRestBits = 4;
    const std::uint32_t magnitude = apart(difference, 0);
    const auto above =
        std::uint32_t(std::max(model.sizeOf(magnitude) - int(DifferenceModel::kSizes) - 1, 0));
    std::uint32_t coded = side.symbol(larger_, std::min(above, kLast));
    if (coded == kLast) coded += side.raw(above - kLast, kRestBits);
    const bool negative = side.bit(largeSign_, difference < 0);
    const int size = int(coded + DifferenceModel::kSizes + 1);
    if (model.bitsOf(size) > 31) throw BadInput("a voxel is further off than can be");
    const std::uint32_t result = codeBits(side, model, size, magnitude);
    return std::int32_t(negative ? 0u - result : result);
  }

  template <class Side>
  [[gnu::always_inline]] static std::uint32_t codeBits(Side& side, DifferenceModel& model, int size,
                                                       std::uint32_t magnitude) {
    const int bits = model.bitsOf(size), leadBits = std::min(bits, DifferenceModel::kLeadBits);
    int below = bits - leadBits;
    const std::uint32_t lead =
        side.symbol(model.leadOf(size), (magnitude >> below) & ((1u << leadBits) - 1u));
    if (lead >> leadBits != 0) throw BadInput("a voxel has bits that cannot be");
    std::uint32_t result = (size == 1 ? 0u : 1u) << leadBits | lead;
    while (below > 0) {
      const int now = std::min(below, kMostRawBits);
      below -= now;
      result = result << now | side.raw((magnitude >> below) & ((1u << now) - 1u), now);
    }
    return result;
  }

  SymbolModel larger_;
  BitModel largeSign_;
};

/// The contexts of differences: first those of the rules, then those of the mirror image.
class DifferenceContexts {
 public:
  DifferenceContexts() {
    models_.reserve(kAround + kImage);
    for (std::size_t n = 0; n < kAround; ++n)
      models_.emplace_back(std::max(int(n / 2) - kBelowSpread, 0));
    for (std::size_t n = 0; n < kImage; ++n)
      models_.emplace_back(std::max(int(n) - kBelowImage, 0));
  }

  /// \param around  differences between the neighbours and recent errors
  [[nodiscard]] DifferenceModel& around(std::uint32_t around) {
    const int width = int(std::bit_width(around));
    const auto half = width > 1 ? around >> (width - 2) & 1u : 0u;
    return models_[std::size_t(2 * width) + half];
  }
  [[nodiscard]] DifferenceModel& image(std::uint32_t error) {
    return models_[kAround + std::min(std::size_t(std::bit_width(error)), kImage - 1)];
  }

 private:
  static constexpr std::size_t kAround = 66, kImage = 31;
  /// Differences have the 7 sizes from so many bits below those of the context.
  static constexpr int kBelowSpread = 5, kBelowImage = 9;

  std::vector<DifferenceModel> models_;
};

// ---- Voxels

// Numbers of contexts. The image of a voxel is missing, inactive or active. For vacancy it is missing, or it is any
// combination of active and vacant.
constexpr std::size_t kActivities = 1024, kImages = 3, kVacancies = 5;
constexpr std::size_t kCopyStates = 8;  // each of the three bricks before is a copy or not
constexpr std::size_t kClasses = VoxelModel::kMaxCommon + 1;

/// Codes the bricks of a block. In a brick that is not a copy, it codes which voxels are active, which of the others are
/// vacant, and then the codes of all that are not vacant.
/// \tparam Side   SymbolWriter, SymbolReader or SymbolMeter
/// \tparam Layer  const VoxelLayer if its codes are written; VoxelLayer if they are read or chosen
template <class Side, class Layer>
class VoxelCoder {
 public:
  /// Most steps of a part of the stream of a block. A voxel takes one step each for its activity, its vacancy and its
  /// class, and at most seven for its difference; a brick and a line take a few, and so do copies.
  static std::size_t mostSteps(std::size_t bricks) {
    return std::min(bricks, kPartBricks) * 11 * kBrickVoxels + 2 * bricks;
  }

  /// \param isCopy  by brick of the layer; the coder sets those of its block
  /// \param thrift  if not null, codes are chosen; otherwise the layer's are coded
  VoxelCoder(const VoxelModel& model, const OwnBricks& bricks, std::vector<std::uint8_t>& isCopy,
             Layer& layer, const Thrift* thrift = nullptr)
      : model_(model),
        layer_(layer),
        bricks_(bricks),
        mirrors_(model, layer, bricks_),
        copies_(model, layer, mirrors_),
        isCopy_(isCopy),
        vacantClass_(std::uint8_t(classOf(model.vacantCode))),
        thrift_(thrift),
        classes_(model.common.empty() ? 0 : kClasses * kClasses * kClasses) {}

  /// The side is an argument and not a member, so that the compiler can keep the state of a reader in registers.
  void brick(Side& side, std::size_t b) {
    Halo::Before before;
    typename BrickCopies<Layer>::Faces faces;
    for (std::size_t axis = 0; axis < faces.size(); ++axis)
      faces[axis] = before[Halo::kFaces[axis]] = find(b, Halo::kFaces[axis]);
    if (codeCopy(side, b, faces)) return;
    beginBrick(side);
    for (const std::size_t n : {0, 1, 2, 4}) before[n] = find(b, n);
    codeActivity(side, b, before);
    codeVacancy(side, b);
    codeValues(side, b, before);
  }

 private:
  static constexpr bool kReads = std::is_same_v<Side, SymbolReader>;
  static constexpr bool kSets = !std::is_const_v<Layer>;  ///< codes are read or chosen
  static constexpr std::uint32_t kLineBits = (1u << kBrickSide) - 1u;
  static constexpr int kLines = kBrickVoxels / kBrickSide;

  [[nodiscard]] std::uint32_t find(std::size_t b, std::size_t number) const {
    return bricks_.find(layer_.bricks[b] + Halo::stepTo(number));
  }

  /// Begins a part of the stream where the one before has kPartBricks.
  void beginBrick(Side& side) {
    if (partBricks_ == kPartBricks) {
      if constexpr (kReads)
        side.beginPart();
      else
        side.endPart();
      partBricks_ = 0;
    }
    ++partBricks_;
  }

  // ---- Copies

  /// Codes whether a brick is a copy and, if it is, the source. \return whether it is a copy
  bool codeCopy(Side& side, std::size_t b, const typename BrickCopies<Layer>::Faces& faces) {
    const auto wanted = kReads ? std::nullopt : copies_.sourceOf(b, faces);
    std::size_t copiesBefore = 0;
    for (const std::uint32_t face : faces)
      copiesBefore =
          copiesBefore << 1 | std::size_t(face != BrickIndex::kNone && isCopy_[face] != 0);
    const bool isCopy = side.bit(copy_[copiesBefore], wanted.has_value());
    isCopy_[b] = isCopy;
    if (!isCopy) return false;
    lastSource_ = side.symbol(sources_[lastSource_], wanted.value_or(0));
    if (lastSource_ >= sources_.size()) throw BadInput("a brick of voxels is a copy of nothing");
    if constexpr (kReads) copies_.copy(b, faces, lastSource_);
    return true;
  }

  // ---- Activity

  /// The activities of a line: bit z + 1 for the voxel z, and bit 0 for the voxel before them.
  using Lines = std::array<std::uint32_t, std::size_t(Halo::kSide* Halo::kSide)>;

  void codeActivity(Side& side, std::size_t b, const Halo::Before& before) {
    Lines lines{};
    Halo::forEachLine(before, [&](std::size_t cell, std::uint32_t neighbour, int v, int count) {
      if (neighbour == BrickIndex::kNone) return;
      const auto bits =
          std::uint32_t(layer_.active[neighbour].words[std::size_t(v / 64)] >> (v % 64));
      lines[cell / Halo::kSide] |= count == 1 ? bits & 1u : (bits & kLineBits) << 1;
    });
    const int active = layer_.active[b].count();  // 0 in a reader, which ignores it
    const std::size_t state = stateOf(lines);
    if (side.bit(uniform_[state], active == 0 || active == kBrickVoxels)) {
      allActive_ = side.bit(full_[state], active != 0);
      if constexpr (kReads)
        if (allActive_) layer_.active[b].setAll();
      return;
    }
    allActive_ = false;
    if (mirrors_.any())
      codeLines<true>(side, b, lines);
    else
      codeLines<false>(side, b, lines);
  }

  /// 0, 1 or 2: none, some or all of the voxels before the brick along x and y are active; and the same for z, times 3.
  static std::size_t stateOf(const Lines& lines) {
    constexpr auto kSide = std::size_t(Halo::kSide);
    std::uint32_t some = 0, all = ~0u, someZ = 0, allZ = 1;
    for (std::size_t n = 1; n < kSide; ++n) {
      for (const std::uint32_t line : {lines[n], lines[n * kSide]}) some |= line, all &= line;
      for (std::size_t m = 1; m < kSide; ++m)
        someZ |= lines[n * kSide + m], allZ &= lines[n * kSide + m];
    }
    const auto of = [](bool any, bool every) { return std::size_t(any) + std::size_t(every); };
    return of((some >> 1) != 0, (all >> 1 & kLineBits) == kLineBits) +
           3 * of((someZ & 1u) != 0, (allZ & 1u) != 0);
  }

  template <bool kMirrors>
  void codeLines(Side& side, std::size_t b, Lines& lines) {
    constexpr auto kSide = std::size_t(Halo::kSide);
    decltype(auto) fast = copyOf(side);
    for (std::size_t x = 0; x < kBrickSide; ++x)
      for (std::size_t y = 0; y < kBrickSide; ++y) {
        auto& word = layer_.active[b].words[x];
        const auto wanted = std::uint32_t(word >> (kBrickSide * y)) & kLineBits;
        std::uint32_t* line = &lines[(x + 1) * kSide + y + 1];
        const LinesAround around{*(line - kSide), *(line - 1), *(line - kSide - 1),
                                 *(line - kSide + (y + 1 < kBrickSide ? 1 : 0))};
        if (around.areUniform(*line)) {
          const std::uint32_t same = (*line & 1u) != 0 ? kLineBits : 0;
          const auto isSame = [&](std::uint32_t other) { return std::size_t(other >> 1 == same); };
          const std::size_t alike = (*line & 1u) << 3 | isSame(around.next) << 2 |
                                    (x == 0 ? 1 : isSame(*(line - 2 * kSide))) << 1 |
                                    (y == 0 ? 1 : isSame(*(line - 2)));
          if (!fast.bit(lineDiffers_[alike], wanted != same)) {
            *line |= same << 1;
            if constexpr (kReads) word |= std::uint64_t(same) << (kBrickSide * y);
            continue;
          }
        }
        for (int z = 0; z < kBrickSide; ++z) {
          std::size_t image = 0;
          if constexpr (kMirrors)
            if (const auto found = imageOf(b, int(x * 64 + y * 8) + z))
              image = found->active ? 2 : 1;
          const bool active =
              fast.bit(active_[image][around.context(*line, z)], (wanted >> z & 1u) != 0);
          *line |= std::uint32_t(active) << (z + 1);
          if constexpr (kReads) word |= std::uint64_t(active) << (kBrickSide * y + std::size_t(z));
        }
      }
    giveBack(fast, side);
  }

  /// The lines before a line along x, along y and along both, and the one after that before it along x.
  struct LinesAround {
    std::uint32_t x, y, xy, next;

    /// True if all voxels of the three lines and the voxel before the line are alike.
    [[nodiscard]] bool areUniform(std::uint32_t line) const {
      constexpr std::uint32_t kAll = (1u << Halo::kSide) - 1u;
      return (line & 1u) != 0 ? (x & y & xy) == kAll : (x | y | xy) == 0;
    }
    /// The activities of ten voxels around the voxel z.
    [[nodiscard]] std::size_t context(std::uint32_t line, int z) const {
      return (x >> z & 7u) | (y >> z & 7u) << 3 | (xy >> z & 3u) << 6 | (line >> z & 1u) << 8 |
             (next >> (z + 1) & 1u) << 9;
    }
  };

  // ---- Vacancy

  enum : std::uint32_t { kAllVacant, kNoneVacant, kSomeVacant };

  /// Codes which voxels that are not active are vacant.
  void codeVacancy(Side& side, std::size_t b) {
    if (allActive_) return;
    const BrickMask& active = layer_.active[b];
    std::uint32_t kind = 0;
    if constexpr (!kReads) {
      const int vacant = layer_.vacant[b].count();
      kind = vacant + active.count() == kBrickVoxels ? kAllVacant
             : vacant == 0                           ? kNoneVacant
                                                     : kSomeVacant;
    }
    lastVacancy_ = side.symbol(vacancies_[lastVacancy_], kind);
    if (lastVacancy_ >= vacancies_.size()) throw BadInput("the vacancy of voxels is unknown");
    if (lastVacancy_ == kSomeVacant) return codeVacantVoxels(side, b);
    if constexpr (kReads)
      if (lastVacancy_ == kAllVacant)
        for (std::size_t x = 0; x < active.words.size(); ++x)
          layer_.vacant[b].words[x] = ~active.words[x];
  }

  void codeVacantVoxels(Side& side, std::size_t b) {
    bool last = false;
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (layer_.active[b].test(v)) continue;
      std::size_t image = 0;
      if (mirrors_.any())
        if (const auto found = imageOf(b, v))
          image = 1u + std::size_t(found->active) + 2u * std::size_t(found->vacant);
      last = side.bit(vacant_[image][last], layer_.vacant[b].test(v));
      if constexpr (kReads)
        if (last) layer_.vacant[b].set(v);
    }
  }

  // ---- Codes

  void codeValues(Side& side, std::size_t b, const Halo::Before& before) {
    halo_.fillCodes(layer_, before, model_.vacantCode);
    codes_ = layer_.codes.data() + b * kBrickVoxels;
    owed_ = 0.0;
    if (layer_.vacant[b].count() == kBrickVoxels) return fill(b, 0);
    const std::int32_t expected = halo_.code[std::size_t(Halo::cell({-1, 0, 0}))];
    const auto only = kReads ? std::nullopt : onlyCode(b);
    lastFlat_ = side.bit(flat_[lastFlat_], only.has_value());
    if (lastFlat_) {
      const std::int32_t difference =
          differences_.code(side, flatDifference_, minus(only.value_or(0), expected));
      return fill(b, plus(expected, difference));
    }
    fillClasses(before);
    for (int n = 0; n < kLines; ++n) codeLine(side, b, n);
  }

  /// The code of all voxels that are not vacant, if there is only one.
  [[nodiscard]] std::optional<std::int32_t> onlyCode(std::size_t b) const {
    std::optional<std::int32_t> only;
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (layer_.vacant[b].test(v)) continue;
      if (only && *only != codes_[v]) return std::nullopt;
      only = codes_[v];
    }
    return only;
  }

  /// Sets the codes of a brick that is flat or vacant.
  void fill(std::size_t b, std::int32_t code) {
    if constexpr (kSets)
      for (int v = 0; v < kBrickVoxels; ++v)
        codes_[v] = layer_.vacant[b].test(v) ? model_.vacantCode : code;
  }

  void codeLine(Side& side, std::size_t b, int n) {
    const auto vacant = std::uint32_t(layer_.vacant[b].words[std::size_t(n / kBrickSide)] >>
                                      (n % kBrickSide * kBrickSide)) &
                        kLineBits;
    const auto cell = std::size_t(Halo::cell(voxelLocal(n * kBrickSide)));
    if (vacant == kLineBits) {
      std::fill_n(&halo_.code[cell], kBrickSide, model_.vacantCode);
      std::fill_n(&class_[cell], kBrickSide, vacantClass_);
      if constexpr (kSets) std::fill_n(codes_ + n * kBrickSide, kBrickSide, model_.vacantCode);
      return;
    }
    const PredictedLine line(&halo_.code[cell]);
    const Place place{b, n * kBrickSide, cell, vacant};
    if (mirrors_.any()) return codeVoxels<0, true>(side, line, place);
    switch (errors_.bestRule()) {
      case 0:
        return codeVoxels<0, false>(side, line, place);
      case 1:
        return codeVoxels<1, false>(side, line, place);
      case 2:
        return codeVoxels<2, false>(side, line, place);
      case 3:
        return codeVoxels<3, false>(side, line, place);
      case 4:
        return codeVoxels<4, false>(side, line, place);
      default:
        return codeVoxels<5, false>(side, line, place);
    }
  }

  struct Place {
    std::size_t brick;
    int first;         ///< offset of the first voxel of a line
    std::size_t cell;  ///< the cell of that voxel
    std::uint32_t vacant;
  };

  /// Codes the voxels of a line that are not vacant.
  /// \tparam kRule     the rule of prediction
  /// \tparam kMirrors  whether voxels may have images; then kRule is ignored
  template <std::size_t kRule, bool kMirrors>
  void codeVoxels(Side& side, const PredictedLine& line, const Place& place) {
    decltype(auto) fast = copyOf(side);
    const std::size_t rule = kMirrors ? errors_.bestRule() : kRule;
    const std::uint32_t late = errors_.of(rule) >> kLateShift;
    std::array<std::int32_t, kBrickSide> counts{};
    std::int32_t* own = &halo_.code[place.cell];
    std::int32_t last = own[-1];
    for (int z = 0; z < kBrickSide; ++z, own[z - 1] = last) {
      const int v = place.first + z;
      if ((place.vacant >> z & 1u) != 0) {
        last = set(v, model_.vacantCode);
        owe(v, last);
        class_[place.cell + std::size_t(z)] = vacantClass_;
        continue;
      }
      std::optional<Image> image;
      if constexpr (kMirrors) image = imageOf(place.brick, v);
      if (!classes_.empty()) {
        const std::uint32_t known = codeClass(fast, place.cell + std::size_t(z), image, v);
        if (known > 0) {
          last = set(v, model_.common[known - 1]);
          owe(v, last);
          continue;
        }
      }
      const bool byImage = kMirrors && image && imageError_ <= errors_.of(rule);
      DifferenceModel& model = byImage ? contexts_.image(imageError_ * 4)
                                       : contexts_.around(line.spread(z, last) + late);
      const std::int32_t guess = byImage    ? image->code
                                 : kMirrors ? guessOf(line, rule, z, last)
                                            : line.template guess<kRule>(z, last);
      const std::int32_t wanted = kReads ? 0 : thriftyCode(model, guess, v);
      last = set(v, plus(guess, differences_.code(fast, model, minus(wanted, guess))));
      owe(v, last);
      counts[std::size_t(z)] = -1;
      if (kMirrors && image) learnImage(apart(last, image->code));
    }
    giveBack(fast, side);
    errors_.learn(line, counts);
  }

  /// Sets the code of a voxel, which is the same as before unless it is read or chosen.
  std::int32_t set(int v, std::int32_t code) {
    if constexpr (kSets) codes_[v] = code;
    return code;
  }

  static std::int32_t guessOf(const PredictedLine& line, std::size_t rule, int z,
                              std::int32_t last) {
    switch (rule) {
      case 0:
        return line.guess<0>(z, last);
      case 1:
        return line.guess<1>(z, last);
      case 2:
        return line.guess<2>(z, last);
      case 3:
        return line.guess<3>(z, last);
      case 4:
        return line.guess<4>(z, last);
      default:
        return line.guess<5>(z, last);
    }
  }

  [[nodiscard]] std::optional<Image> imageOf(std::size_t b, int v) {
    return mirrors_.imageOf(layer_.bricks[b] * kBrickSide + voxelLocal(v));
  }
  void learnImage(std::uint32_t error) {
    constexpr std::uint32_t kMaxError = 1u << 20;
    constexpr int kFade = 4;
    imageError_ += std::min(error, kMaxError) - (imageError_ >> kFade);
  }

  // ---- Common codes

  /// Sets the classes of the voxels before the brick.
  void fillClasses(const Halo::Before& before) {
    if (classes_.empty()) return;
    Halo::forEachLine(before, [&](std::size_t cell, std::uint32_t, int, int count) {
      for (int n = 0; n < count; ++n, ++cell) {
        const std::int32_t code = halo_.code[cell];
        class_[cell] = code == model_.vacantCode ? vacantClass_ : std::uint8_t(classOf(code));
      }
    });
  }

  /// The number of a common code, counted from 1; 0 for all other codes.
  [[nodiscard]] std::uint32_t classOf(std::int32_t code) const {
    const auto it = std::find(model_.common.begin(), model_.common.end(), code);
    return it == model_.common.end() ? 0u : std::uint32_t(it - model_.common.begin()) + 1u;
  }

  template <class Fast>
  std::uint32_t codeClass(Fast& side, std::size_t cell, const std::optional<Image>& image, int v) {
    std::size_t around = 0;
    for (const int back : {Halo::kStepX, Halo::kStepY, Halo::kStepZ})
      around = around * kClasses + class_[cell - std::size_t(back)];
    auto& model = image ? imageClasses_[classOf(image->code)] : classes_[around];
    const std::uint32_t coded = side.symbol(model, kReads ? 0u : classOf(codes_[v]));
    if (coded > model_.common.size()) throw BadInput("a voxel is none of the common ones");
    class_[cell] = std::uint8_t(coded);
    return coded;
  }

  // ---- The choice of codes

  /// A voxel in units of the lattice.
  [[nodiscard]] double exactOf(int v) const {
    return thrift_->exact[std::size_t(codes_ - layer_.codes.data()) + std::size_t(v)];
  }

  /// Adds the error of a code to those of the brick.
  void owe(int v, std::int32_t code) {
    if constexpr (!kReads)
      if (thrift_ && thrift_->massPrice > 0.0) owed_ += double(code) - exactOf(v);
  }

  /// The code with the least sum of squared error, price of bits, and price of the brick's error: the nearest one, the
  /// next ones towards the prediction, the prediction itself if it is near, or the one beside the nearest that makes up
  /// for errors of the brick.
  std::int32_t thriftyCode(DifferenceModel& model, std::int32_t guess, int v) const {
    const std::int32_t nearest = codes_[v];
    if (!thrift_ || (guess == nearest && thrift_->massPrice == 0.0)) return nearest;
    const double exact = exactOf(v);
    const auto costOf = [&](std::int32_t code) {
      const double error = double(code) - exact, all = owed_ + error;
      const std::uint32_t price = VoxelDifferences::priceOf(model, minus(code, guess));
      return error * error + thrift_->massPrice * all * all +
             thrift_->bitPrice * double(price) / double(1 << BitPrices::kFractionBits);
    };
    const std::int32_t step = guess > nearest ? 1 : -1;
    double least = costOf(nearest);
    std::int32_t best = nearest;
    for (int n = 1; n <= Thrift::kMaxSteps && nearest + (n - 1) * step != guess; ++n) {
      const std::int32_t code = nearest + n * step;
      if (thrift_->signs == RoundedSigns::kKept && (code < 0) != (nearest < 0)) break;
      const double cost = costOf(code);
      if (cost < least) least = cost, best = code;
    }
    if (thrift_->massPrice > 0.0) {
      const std::int32_t code = nearest + (owed_ < 0.0 ? 1 : -1);
      const bool mayBe = thrift_->signs != RoundedSigns::kKept || (code < 0) == (nearest < 0);
      if (mayBe && costOf(code) < least) best = code;
    }
    return best;
  }

  // ---- Copies of a reader

  /// A reader is copied for a loop, and its state is given back afterwards. The other sides are not copied.
  static decltype(auto) copyOf(Side& side) {
    if constexpr (kReads)
      return Side(side);
    else
      return (side);
  }
  static void giveBack(const Side& copy, Side& side) {
    if constexpr (kReads) side = copy;
  }

  /// The recent errors of a rule are 128 times the mean error of a voxel, which is a part of the context.
  static constexpr int kLateShift = 7;

  const VoxelModel& model_;
  Layer& layer_;
  OwnBricks bricks_;
  Mirrors mirrors_;
  BrickCopies<Layer> copies_;
  std::vector<std::uint8_t>& isCopy_;
  std::uint8_t vacantClass_;
  const Thrift* thrift_;
  double owed_ = 0.0;              ///< sum of the errors of the brick so far, in steps
  std::size_t partBricks_ = 0;     ///< bricks of this part of the stream that are no copies
  std::uint32_t lastSource_ = 0;   ///< source of the latest brick that was a copy
  std::uint32_t lastVacancy_ = 0;  ///< vacancy of the latest brick that has one
  bool allActive_ = false, lastFlat_ = false;
  Halo halo_{};
  std::array<std::uint8_t, Halo::kCells>
      class_{};  ///< the numbers of the codes in the halo (classOf)
  std::conditional_t<kSets, std::int32_t*, const std::int32_t*> codes_ =
      nullptr;  ///< codes of the brick
  RuleErrors errors_;
  std::uint32_t imageError_ = 0;
  VoxelDifferences differences_;
  std::array<BitModel, kCopyStates> copy_;
  std::array<SymbolModel, kImageSource + 1> sources_{SymbolModel(4), SymbolModel(4), SymbolModel(4),
                                                     SymbolModel(4)};
  std::array<BitModel, 9> uniform_, full_;
  std::array<BitModel, 16> lineDiffers_;
  std::array<std::array<BitModel, kActivities>, kImages> active_;
  std::array<SymbolModel, 3> vacancies_{SymbolModel(3), SymbolModel(3), SymbolModel(3)};
  std::array<std::array<BitModel, 2>, kVacancies> vacant_;
  std::array<BitModel, 2> flat_;
  DifferenceModel flatDifference_{0};
  DifferenceContexts contexts_;
  std::vector<SymbolModel> classes_;  ///< empty if there are no common codes
  std::array<SymbolModel, kClasses> imageClasses_;
};

/// Codes the bricks of a block.
/// \param mostBytes  the work stops after the brick with which there are more
template <class Layer>
CodedPart measureBlock(const VoxelModel& model, const OwnBricks& bricks,
                       std::vector<std::uint8_t>& isCopy, std::uint64_t mostBytes,
                       const Thrift* thrift, Layer& layer) {
  const auto coder =
      std::make_unique<VoxelCoder<SymbolMeter, Layer>>(model, bricks, isCopy, layer, thrift);
  const auto order = bricks.blocks[bricks.block];
  SymbolMeter meter;
  CodedPart part;
  while (part.bricks < order.size() && part.bytes <= mostBytes) {
    throwIfCancelled();
    coder->brick(meter, order[part.bricks++]);
    part.bytes = meter.bytes();
  }
  meter.endPart();
  part.bytes = meter.bytes();
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
      parts[block] = measureBlock(model, {blocks, block}, isCopy, mostBytes, thrift, layer);
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

std::vector<Stream> encodeVoxels(const VoxelModel& model, const VoxelLayer& layer) {
  using Coder = VoxelCoder<SymbolWriter, const VoxelLayer>;
  const Blocks blocks(layer.bricks, model);
  std::vector<std::uint8_t> isCopy(layer.bricks.size());
  std::vector<Stream> streams(blocks.size());
  parallelFor(std::size_t{0}, blocks.size(), [&](std::size_t block) {
    const auto order = blocks[block];
    SymbolWriter writer(Coder::mostSteps(order.size()));
    const auto coder = std::make_unique<Coder>(model, OwnBricks{blocks, block}, isCopy, layer);
    for (const std::size_t b : order) {
      throwIfCancelled();
      coder->brick(writer, b);
    }
    writer.endPart();
    streams[block] = writer.bytes();
  });
  return streams;
}

void decodeVoxels(std::span<const StreamView> streams, const VoxelModel& model, VoxelLayer& layer) {
  using Coder = VoxelCoder<SymbolReader, VoxelLayer>;
  const Blocks blocks(layer.bricks, model);
  std::vector<std::uint8_t> isCopy(layer.bricks.size());
  parallelFor(std::size_t{0}, blocks.size(), [&](std::size_t block) {
    SymbolReader reader(streams[block]);
    reader.beginPart();
    const auto coder = std::make_unique<Coder>(model, OwnBricks{blocks, block}, isCopy, layer);
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

std::uint64_t bytesOfCodes(const VoxelModel& model, const VoxelLayer& layer) {
  return codeUpTo(std::numeric_limits<std::uint64_t>::max(), model, nullptr, layer).bytes;
}

}  // namespace esvr::codec
