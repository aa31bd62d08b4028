#pragma once
/// Predicts the code of a voxel from the voxels before it and from the previous frame around it.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "codec/least_squares.h"
#include "codec/past_voxels.h"
#include "codec/voxel_halo.h"

namespace esvr::codec {

class FramePredictor {
 public:
  /// Numbers of contexts. The last context is that of a guess that equals the vacant code.
  static constexpr std::size_t kContexts = 16, kParts = 5, kDistances = 12;
  static constexpr int kFractionBits = 4;  ///< predictions are rounded to 1/16 of a code

  /// Computes the prediction of a voxel.
  /// \param now     the voxel in the codes of a halo
  /// \param past    the voxel in the places of a cube of the previous frame
  /// \param errors  the voxel in the results of learn(), in the cells of a halo
  void look(const std::int32_t* now, const double* past, const std::uint8_t* errors) {
    past_ = *past;
    low_ = high_ = past_;
    std::size_t n = 0;
    for (const int back : kBefore) add(n, double(now[-back]));
    for (const int step : kAround) add(n, past[step]);
    const double guess = std::clamp(past_ + sums_.predict(terms_), low_, high_);
    fixed_ = std::int64_t(std::floor(std::clamp(guess, -0x1p40, 0x1p40) * kOne + 0.5));
    guess_ = (fixed_ + kOne / 2) >> kFractionBits;
    std::int64_t late = 0;
    for (std::size_t k = 0; k < 6; ++k) late += (k < 3 ? 2 : 1) * std::int64_t(errors[-kBefore[k]]);
    double change = 0.0;
    for (std::size_t k = 0; k < 3; ++k) change += std::abs(terms_[k] - terms_[7 + k]);
    expected_ = std::uint64_t(late) + std::uint64_t(std::min(change, 0x1p40) * 8.0) +
                std::uint64_t(std::min(high_ - low_, 0x1p40) * 4.0);
  }

  [[nodiscard]] std::int64_t guess() const { return guess_; }

  /// The context of the difference from the guess: the octave of the errors and changes around.
  [[nodiscard]] std::size_t context(std::int32_t vacantCode) const {
    if (guess_ == vacantCode) return kContexts - 1;
    return std::min(std::size_t(std::bit_width(expected_)), kContexts - 2);
  }

  /// The part of a code by which the guess was rounded, from 0 (up) to kParts - 1 (down).
  [[nodiscard]] std::size_t part() const {
    const std::int64_t rest = fixed_ - guess_ * kOne;  // from -8 to 7
    return std::size_t((rest + kOne / 2) * std::int64_t(kParts) / kOne);
  }

  /// The distance of the prediction from a code, in steps that grow.
  [[nodiscard]] std::size_t distanceFrom(std::int32_t code) const {
    const auto far = std::uint64_t(std::abs(fixed_ - std::int64_t(code) * kOne));
    if (far < 16) return std::size_t(far / 2);
    return std::min<std::size_t>(8 + std::size_t(std::bit_width(far / 32)), kDistances - 1);
  }

  /// \return the error of the prediction in 1/16 of a code, at most 255
  std::uint8_t learn(std::int32_t code) {
    if (low_ != high_ || double(code) != low_) sums_.learn(terms_, double(code) - past_);
    return std::uint8_t(std::min<std::int64_t>(std::abs(fixed_ - code * std::int64_t(kOne)), 255));
  }

  void solve() { sums_.solve(); }
  void fade() { sums_.fade(); }

 private:
  static constexpr int kOne = 1 << kFractionBits;
  static constexpr std::size_t kTerms = 18;
  using Cube = PastCube<1>;
  static constexpr std::array kBefore{Halo::kStepX,
                                      Halo::kStepY,
                                      Halo::kStepZ,
                                      Halo::kStepX + Halo::kStepY,
                                      Halo::kStepX + Halo::kStepZ,
                                      Halo::kStepY + Halo::kStepZ,
                                      Halo::kStepX + Halo::kStepY + Halo::kStepZ};
  static constexpr std::array kAround{-Cube::kStepX,
                                      -Cube::kStepY,
                                      -Cube::kStepZ,
                                      -Cube::kStepX - Cube::kStepY,
                                      -Cube::kStepX - Cube::kStepZ,
                                      -Cube::kStepY - Cube::kStepZ,
                                      -Cube::kStepX - Cube::kStepY - Cube::kStepZ,
                                      Cube::kStepX,
                                      Cube::kStepY,
                                      Cube::kStepZ,
                                      Cube::kStepX + Cube::kStepY + Cube::kStepZ};
  /// A third of the change of the voxels before it along the axes.
  static constexpr std::array<double, kTerms> kFirstWeights{
      0.33, 0.33, 0.33, 0, 0, 0, 0, -0.33, -0.33, -0.33, 0, 0, 0, 0, 0, 0, 0, 0};

  void add(std::size_t& n, double value) {
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
    terms_[n++] = value - past_;
  }

  LeastSquares<kTerms> sums_{kFirstWeights};
  std::array<double, kTerms> terms_{};
  double past_ = 0.0, low_ = 0.0, high_ = 0.0;
  std::int64_t fixed_ = 0, guess_ = 0;
  std::uint64_t expected_ = 0;
};

}  // namespace esvr::codec
