#pragma once
/// Chooses the shapes of ellipsoids that continue others by their error and their bits.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "codec/continued_shapes.h"
#include "codec/nearest_axes.h"
#include "codec/rounding.h"
#include "codec/thrifty_code.h"
#include "esvr/ellipsoids.h"

namespace esvr::codec {

class ShapeChoice {
 public:
  /// All must outlive the object. \param bitPrice  see ContinuedThrift
  ShapeChoice(ContinuedShapes& shapes, const Ellipsoids& ellipsoids, double bitPrice)
      : shapes_(shapes), ellipsoids_(ellipsoids), bitPrice_(bitPrice) {}

  /// The cheapest of three shapes of an ellipsoid that continues the one to which ContinuedShapes
  /// looks: the shape before, the best one with the rotation before, and the nearest one.
  /// \throws RuntimeFailure  a scale lies outside the lattice
  [[nodiscard]] Shape cheapest(std::size_t i) {
    const NearestAxes exact(ellipsoids_, i, shapes_.quaternionBefore());
    const double stepLog = shapes_.lattice().scaleStep * std::ldexp(1.0, -shapes_.finerScaleBits());
    Shape best;
    double least = HUGE_VAL;
    const auto consider = [&](const Shape& shape) {
      BitMeter meter;
      (void)shapes_.code(meter, shape);
      const double cost = errorOf(exact, shape) / (stepLog * stepLog) + bitPrice_ * meter.bits;
      if (cost < least) least = cost, best = shape;
    };
    consider(shapes_.before());
    consider(withRotationBefore(exact));
    consider(nearestShape(exact));
    return best;
  }

 private:
  static constexpr int kRotationBits = Lattice::kMaxRotationBits;

  /// The squared error of a shape, as the sum of squares of the errors of logarithms of scales.
  [[nodiscard]] double errorOf(const NearestAxes& exact, const Shape& shape) const {
    const CoarseScales s = coarseOf(shape.scale, shapes_.finerScaleBits());
    const AxisBits bits = rotationBits(shapes_.lattice(), shapes_.precision(), s, shape.rotation);
    return exact.squaredError(logScalesOf(shapes_.lattice(), shapes_.finerScaleBits(), shape.scale),
                              quaternionOf(shape.rotation, bits));
  }

  /// Rounds scales, the smallest first, each relative to the rounded one before.
  [[nodiscard]] std::array<std::uint32_t, 3> roundedScales(const std::array<double, 3>& logs) {
    const int bits = shapes_.finerScaleBits();
    std::array<std::uint32_t, 3> codes{};
    double below = double(shapes_.lattice().lowestScale);
    for (std::size_t a = 0; a < 3; ++a) {
      const double steps =
          (logs[2 - a] / shapes_.lattice().scaleStep - below) * std::ldexp(1.0, bits);
      codes[a] = thriftyScale(a, steps - 0.5);
      below += middleOfCode(codes[a], bits);
    }
    return codes;
  }

  [[nodiscard]] std::uint32_t thriftyScale(std::size_t a, double exact) {
    const double last =
        std::ldexp(double(Lattice::kMaxCoarseScale) + 1.0, shapes_.finerScaleBits()) - 1.0;
    if (!(exact <= last)) throw RuntimeFailure("cannot quantise: a scale lies outside the lattice");
    return std::uint32_t(thriftyCode(std::max(exact, 0.0), std::int64_t(shapes_.scaleBefore(a)),
                                     bitPrice_, [&](auto& meter, std::int64_t code) {
                                       (void)shapes_.codeScale(meter, a, 0, std::uint32_t(code));
                                     }));
  }

  [[nodiscard]] Shape withRotationBefore(const NearestAxes& exact) {
    Shape shape;
    shape.scale = roundedScales(exact.logScalesAlong(shapes_.quaternionBefore()));
    shape.rotation = shapes_.onLattice(shape);
    return shape;
  }

  /// The shape with the rounded exact rotation. As in quantise(), the coarse bits of a component are
  /// rounded down, and the others are rounded one component after the other (rounding.h).
  [[nodiscard]] Shape nearestShape(const NearestAxes& exact) {
    Shape shape;
    shape.scale = roundedScales(exact.axes().logScale);
    const CoarseScales s = coarseOf(shape.scale, shapes_.finerScaleBits());
    const int precision = shapes_.precision();
    const int coarse = coarseRotationBits(shapes_.lattice(), precision, s);
    const auto places = rotationPlaces(exact.axes());
    for (std::size_t a = 0; a < 3; ++a)
      shape.rotation[a] = truncated(std::uint32_t(places[a]), coarse);
    const AxisBits bits = rotationBits(shapes_.lattice(), precision, s, shape.rotation);
    const CoupledErrors errors = rotationErrors(exact.axes());
    std::array<double, 3> error{};
    for (std::size_t a = 0; a < 3; ++a) {
      const int below = kRotationBits - bits[a];
      const auto first = std::int64_t(shape.rotation[a]) >> below;
      const std::int64_t last = first + (std::int64_t{1} << (bits[a] - coarse)) - 1;
      const double wanted = places[a] + errors.shift(a, error);
      const auto nearest = std::int64_t(std::floor(std::ldexp(wanted, -below)));
      const std::int64_t code = std::clamp(nearest, first, last);
      shape.rotation[a] = std::uint16_t(code << below);
      error[a] = std::ldexp(double(code) + 0.5, below) - places[a];
    }
    return shape;
  }

  /// The components of a rotation in units of the last bit of a code.
  static std::array<double, 3> rotationPlaces(const SortedAxes& axes) {
    const double end = std::ldexp(1.0, kRotationBits);
    std::array<double, 3> places{};
    for (std::size_t a = 0; a < 3; ++a)
      places[a] = std::clamp((axes.rotation[a + 1] / kRotationSide + 0.5) * end, 0.0, end - 1.0);
    return places;
  }

  ContinuedShapes& shapes_;
  const Ellipsoids& ellipsoids_;
  double bitPrice_;
};

}  // namespace esvr::codec
