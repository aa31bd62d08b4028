#pragma once
/// Predicts how an ellipsoid moves from one frame to the next. The file that includes this header must
/// be compiled without contraction to fused operations (least_squares.h).

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "codec/least_squares.h"
#include "codec/motion_map.h"
#include "esvr/quantised.h"

namespace esvr::codec {

/// Places are integers in units of 2^-kUnitBits cells, so that the middle of every code is one.
inline constexpr int kUnitBits = Lattice::kMaxPositionBits + 1;
inline constexpr int kMotionBits = 8;  // motions are in units of 2^-kMotionBits cells

/// Magnitudes for ExpectedMagnitude have this number of bits below a cell, a coarse step of scale,
/// the interval of a rotation's component, and the magnitude of an intensity.
inline constexpr int kMagnitudeBits = Lattice::kMaxPositionBits;

/// Predicts motions from the motions around.
class MotionPredictor {
 public:
  explicit MotionPredictor(std::span<const Vector64> places) : map_(places) {}

  /// \param own  the motion of the ellipsoid to the previous frame, in units of motions
  void look(const Vector64& place, const std::array<std::int32_t, 3>& own) {
    own_ = own;
    sum_ = map_.around(place);
    const MotionSum& from = sum_.count > 0 ? sum_ : all_;
    const double count = double(std::max<std::int64_t>(from.count, 1));
    for (std::size_t a = 0; a < 3; ++a)
      terms_[a] = {double(from.now[a]) / count * kScale, double(from.before[a]) / count * kScale,
                   double(own[a]) * kScale};
    expected_ = std::uint64_t(from.count > 0 ? from.error / from.count : 1 << kMotionBits);
  }

  /// The predicted motion along an axis in units of places.
  [[nodiscard]] std::int64_t motion(std::size_t axis) const {
    const double steps = sums_[axis].predict(terms_[axis]) / kScale;
    constexpr double kLargest = 0x1p30;
    return std::int64_t(std::floor(std::clamp(steps, -kLargest, kLargest) + 0.5)) *
           (std::int64_t{1} << (kUnitBits - kMotionBits));
  }

  /// Expected magnitude of the error along an axis, with kMagnitudeBits bits below a cell.
  [[nodiscard]] std::uint64_t expected() const {
    return expected_ << (kMagnitudeBits - kMotionBits);
  }

  void learn(const Vector64& place, const std::array<std::int32_t, 3>& motion) {
    MotionSum one{1, {}, {}, 0};
    for (std::size_t a = 0; a < 3; ++a) {
      const double target = double(motion[a]) * kScale;
      one.now[a] = motion[a];
      one.before[a] = own_[a];
      one.error +=
          std::int64_t(std::min(std::abs(sums_[a].predict(terms_[a]) - target) / kScale, 0x1p30)) /
          3;
      sums_[a].learn(terms_[a], target);
      sums_[a].solve();
    }
    map_.add(place, one);
    all_.add(one);
  }

 private:
  static constexpr std::size_t kTerms = 3;
  static constexpr double kScale = 1.0 / (1 << 4);  // to sixteenths of a cell
  /// The motion around, and a part of what the motion before differs from those around.
  using Sums = LeastSquares<kTerms>;
  std::array<Sums, 3> sums_{Sums({1.0, -0.3, 0.3}), Sums({1.0, -0.3, 0.3}), Sums({1.0, -0.3, 0.3})};
  std::array<Sums::Terms, 3> terms_{};
  std::array<std::int32_t, 3> own_{};
  MotionMap map_;
  MotionSum sum_, all_;
  std::uint64_t expected_ = 0;
};

}  // namespace esvr::codec
