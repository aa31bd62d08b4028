#include "format/old_voxel_coder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <memory>

#include "esvr/error.h"
#include "format/voxel_halo.h"

namespace esvr::format {
namespace {

constexpr int kStepX = Halo::kStepX, kStepY = Halo::kStepY, kStepZ = Halo::kStepZ;
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

class OldVoxelReader {
 public:
  OldVoxelReader(Reader& side, std::int32_t vacantCode, VoxelLayer& layer)
      : side_(side), vacantCode_(vacantCode), layer_(layer), index_(layer.bricks) {}

  void brick(std::size_t b) {
    halo_.fill(layer_, index_, b, vacantCode_);
    for (int v = 0; v < kBrickVoxels; ++v) voxel(b, v);
  }

 private:
  void voxel(std::size_t b, int v) {
    const int cell = Halo::cell(voxelLocal(v));
    std::int32_t& code = layer_.codes[b * kBrickVoxels + std::size_t(v)];
    const bool active = side_.coder.bit(active_[halo_.activityAround(cell)]);
    if (active) layer_.active[b].set(v);
    const bool vacant = !active && side_.coder.bit(vacant_);
    if (vacant) layer_.vacant[b].set(v);
    code = vacant ? vacantCode_ : value(cell);
    halo_.code[std::size_t(cell)] = code;
    halo_.active[std::size_t(cell)] = active;
  }

  std::int32_t value(int cell) {
    predictor_.look(&halo_.code[std::size_t(cell)]);
    const std::size_t context = predictor_.context();
    const std::uint64_t magnitude = magnitudes_[context].code(side_, std::uint64_t{0});
    if (magnitude > kMostDifference) throw BadInput("a voxel is further off than can be");
    const bool negative = magnitude != 0 && side_.coder.bit(sign_[context][lastNegative_]);
    if (magnitude != 0) lastNegative_ = negative;
    const auto coded = std::int64_t(magnitude);
    const std::int64_t result = predictor_.guess() + (negative ? -coded : coded);
    if (result != std::int32_t(result)) throw BadInput("a voxel does not fit 32 bits");
    predictor_.learn(result);
    return std::int32_t(result);
  }

  /// A guess is a sum of seven codes at most.
  static constexpr std::uint64_t kMostDifference = std::uint64_t{1} << 35;

  Reader& side_;
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

}  // namespace

void readOldVoxels(Reader& side, std::span<const std::size_t> order, std::int32_t vacantCode,
                   VoxelLayer& layer) {
  const auto reader = std::make_unique<OldVoxelReader>(side, vacantCode, layer);
  for (const std::size_t b : order) reader->brick(b);
}

}  // namespace esvr::format
