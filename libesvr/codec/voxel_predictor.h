#pragma once
/// Predicts the code of a voxel from the voxels before it and from its mirror image. Of several
/// predictions it takes the one with the smallest recent error. Only integers are used
/// (docs/format.md, "Voxels").

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <optional>

#include "codec/voxel_halo.h"

namespace esvr::codec {

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

}  // namespace esvr::codec
