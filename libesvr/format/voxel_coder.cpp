#include "format/voxel_coder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <memory>

#include "esvr/error.h"
#include "field/brick_index.h"

namespace esvr::format {
namespace {

constexpr int kSide = kBrickSide + 1;  // a brick and the voxels before it, along every axis
constexpr int kCells = kSide * kSide * kSide;
constexpr int kStepX = kSide * kSide, kStepY = kSide, kStepZ = 1;

/// A brick's codes and activity with those of the voxels before it, one deep.
struct Halo {
  std::array<std::int32_t, kCells> code;
  std::array<bool, kCells> active;

  static int cell(Coord local) {
    return (local.x + 1) * kStepX + (local.y + 1) * kStepY + local.z + 1;
  }
};

constexpr std::size_t kPredictors = 5;
constexpr std::size_t kActivityContexts = 128, kErrorContexts = 24;

/// Guesses a voxel from the seven before it by whichever rule has done best lately.
class Predictor {
 public:
  void look(const std::int32_t* at) {
    const std::int64_t a = at[-kStepX], b = at[-kStepY], c = at[-kStepZ], ab = at[-kStepX - kStepY],
                       ac = at[-kStepX - kStepZ], bc = at[-kStepY - kStepZ],
                       abc = at[-kStepX - kStepY - kStepZ];
    const std::int64_t low = std::min({a, b, c}), high = std::max({a, b, c});
    const std::int64_t lorenzo = a + b + c - ab - ac - bc + abc;
    guesses_ = {std::clamp(lorenzo, low, high), (a + b + c) / 3,
                (2 * (a + b + c) - ab - ac - bc) / 3, c + (b - bc + a - ac) / 2, lorenzo};
    spread_ = std::abs(a - ab) + std::abs(b - bc) + std::abs(c - ac) + std::abs(a - ac) +
              std::abs(b - ab) + std::abs(c - bc);
    best_ = std::size_t(std::min_element(errors_.begin(), errors_.end()) - errors_.begin());
  }

  [[nodiscard]] std::int64_t guess() const { return guesses_[best_]; }

  /// How far off a guess is likely to be: width of the spread around the voxel and of late errors.
  [[nodiscard]] std::size_t context() const {
    const auto around = std::uint64_t(spread_) + std::uint64_t(errors_[best_] >> kMemory) * 2;
    // half octaves
    const int width = int(std::bit_width(around));
    const bool upper = width > 1 && ((around >> (width - 2)) & 1u) != 0;
    return std::min<std::size_t>(std::size_t(2 * width + (upper ? 1 : 0)), kErrorContexts - 1);
  }

  void learn(std::int64_t value) {
    for (std::size_t k = 0; k < kPredictors; ++k)
      errors_[k] += std::min<std::int64_t>(std::abs(value - guesses_[k]), kMostError) -
                    (errors_[k] >> kMemory);
  }

 private:
  static constexpr int kMemory = 3;  // errors fade by an eighth
  static constexpr std::int64_t kMostError = std::int64_t{1} << 34;
  std::array<std::int64_t, kPredictors> guesses_{}, errors_{};
  std::int64_t spread_ = 0;
  std::size_t best_ = 0;
};

template <class Side>
class VoxelCoder {
 public:
  VoxelCoder(Side& side, std::int32_t vacantCode, VoxelLayer& layer)
      : side_(side), vacantCode_(vacantCode), layer_(layer), index_(layer.bricks) {}

  void brick(std::size_t b) {
    fillHalo(b);
    for (int v = 0; v < kBrickVoxels; ++v) voxel(b, v);
  }

 private:
  /// What lies before the brick; zeros within it do no harm, each is set before it is read.
  void fillHalo(std::size_t b) {
    for (int corner = 0; corner < 7; ++corner) {  // of 8, the last being the brick itself
      const Coord step{(corner >> 2 & 1) - 1, (corner >> 1 & 1) - 1, (corner & 1) - 1};
      copyFrom(index_.find(layer_.bricks[b] + step), step);
    }
  }

  /// The last slice along every axis on which the step is -1.
  void copyFrom(std::uint32_t neighbour, Coord step) {
    const auto first = [](int s) { return s < 0 ? -1 : 0; };
    const auto last = [](int s) { return s < 0 ? -1 : kBrickSide - 1; };
    for (int x = first(step.x); x <= last(step.x); ++x)
      for (int y = first(step.y); y <= last(step.y); ++y)
        for (int z = first(step.z); z <= last(step.z); ++z) {
          const int cell = Halo::cell({x, y, z});
          const int v = voxelOffset(localOf({x, y, z}));
          const bool there = neighbour != BrickIndex::kNone;
          halo_.code[cell] =
              there ? layer_.codes[neighbour * std::size_t(kBrickVoxels) + std::size_t(v)]
                    : vacantCode_;
          halo_.active[cell] = there && layer_.active[neighbour].test(v);
        }
  }

  void voxel(std::size_t b, int v) {
    const int cell = Halo::cell(voxelLocal(v));
    std::int32_t& code = layer_.codes[b * kBrickVoxels + std::size_t(v)];
    const bool active = side_.bit(active_[activityAround(cell)], layer_.active[b].test(v));
    if (active) layer_.active[b].set(v);
    const bool vacant = !active && side_.bit(vacant_, layer_.vacant[b].test(v));
    if (vacant) {
      layer_.vacant[b].set(v);
      code = vacantCode_;
    } else {
      code = value(cell, code);
    }
    halo_.code[cell] = code;
    halo_.active[cell] = active;
  }

  [[nodiscard]] std::size_t activityAround(int cell) const {
    std::size_t bits = 0;
    for (const int back : {kStepX, kStepY, kStepZ, kStepX + kStepY, kStepX + kStepZ,
                           kStepY + kStepZ, kStepX + kStepY + kStepZ})
      bits = bits << 1 | std::size_t(halo_.active[cell - back]);
    return bits;
  }

  std::int32_t value(int cell, std::int32_t written) {
    predictor_.look(&halo_.code[cell]);
    const std::size_t context = predictor_.context();
    const std::int64_t difference = std::int64_t(written) - predictor_.guess();
    const std::uint64_t magnitude =
        magnitudes_[context].code(side_, std::uint64_t(std::abs(difference)));
    if (magnitude > kMostDifference) throw BadInput("a voxel is further off than can be");
    const bool negative =
        magnitude != 0 && side_.bit(sign_[context][lastNegative_], difference < 0);
    if (magnitude != 0) lastNegative_ = negative;
    const auto coded = std::int64_t(magnitude);
    const std::int64_t result = predictor_.guess() + (negative ? -coded : coded);
    if (result != std::int32_t(result)) throw BadInput("a voxel does not fit 32 bits");
    predictor_.learn(result);
    return std::int32_t(result);
  }

  /// A guess is a sum of seven codes at most.
  static constexpr std::uint64_t kMostDifference = std::uint64_t{1} << 35;

  Side& side_;
  std::int32_t vacantCode_;
  VoxelLayer& layer_;
  BrickIndex index_;
  Halo halo_{};
  Predictor predictor_;
  bool lastNegative_ = false;
  std::array<BitModel, kActivityContexts> active_;
  BitModel vacant_;
  std::array<std::array<BitModel, 2>, kErrorContexts> sign_;
  std::array<NumberModelOf<6>, kErrorContexts> magnitudes_;
};

template <class Side>
void code(Side& side, std::span<const std::size_t> order, std::int32_t vacantCode,
          VoxelLayer& layer) {
  const auto coder = std::make_unique<VoxelCoder<Side>>(side, vacantCode, layer);
  for (const std::size_t b : order) coder->brick(b);
}

}  // namespace

void codeVoxels(Writer& side, std::span<const std::size_t> order, std::int32_t vacantCode,
                VoxelLayer& layer) {
  code(side, order, vacantCode, layer);
}
void codeVoxels(Reader& side, std::span<const std::size_t> order, std::int32_t vacantCode,
                VoxelLayer& layer) {
  code(side, order, vacantCode, layer);
}

}  // namespace esvr::format
