#pragma once
/// Codes the shapes of ellipsoids that continue others, as differences from the shapes before.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "codec/code_values.h"
#include "codec/difference_model.h"
#include "codec/lattice_bits.h"
#include "codec/motion_predictor.h"
#include "esvr/error.h"
#include "esvr/quantised.h"

namespace esvr::codec {

/// Expected magnitude before the first difference.
inline constexpr std::uint64_t kFirstExpected = std::uint64_t{1} << (kMagnitudeBits - 2);

inline void requireOnLattice(bool holds, const char* what) {
  if (!holds) throw BadInput(std::string(what) + " lies outside the lattice");
}

/// The codes of an ellipsoid's shape.
struct Shape {
  std::array<std::uint32_t, 3> scale{};
  RotationCodes rotation{};
};

/// The first bits of a code of a rotation's component; the others are 0.
[[nodiscard]] inline std::uint16_t truncated(std::uint32_t code, int bits) {
  const int below = Lattice::kMaxRotationBits - bits;
  return std::uint16_t((code >> below) << below);
}

class ContinuedShapes {
 public:
  /// Both must outlive the object.
  ContinuedShapes(const QuantisedEllipsoids& before, const Lattice& lattice)
      : before_(before), lattice_(lattice) {}

  /// Turns to the ellipsoid of the previous frame that is continued.
  void look(std::size_t p) { p_ = p, changed_ = 0; }

  [[nodiscard]] const Lattice& lattice() const { return lattice_; }
  [[nodiscard]] int precision() const { return before_.precision[p_]; }
  [[nodiscard]] Quaternion quaternionBefore() const {
    return quaternionOf(rotationCodes(before_, p_), shapeBits(before_, p_).rotation);
  }
  /// Number of scales that the last call of learn() has seen to change.
  [[nodiscard]] std::size_t changedScales() const { return changed_; }

  [[nodiscard]] int finerScaleBits() const { return scaleBits(lattice_, before_.precision[p_]); }

  /// The code of a scale of the previous frame on the lattice of this one: the middle of its
  /// interval, rounded down.
  [[nodiscard]] std::uint32_t scaleBefore(std::size_t a) const {
    const int more = finerScaleBits() - scaleBits(before_.lattice, before_.precision[p_]);
    const std::uint32_t code = before_.scale[a][p_];
    if (more <= 0) return code >> -more;
    return (code << more) + (1u << (more - 1));
  }

  /// The shape of the previous frame on the lattice of this one.
  [[nodiscard]] Shape before() const {
    Shape shape;
    for (std::size_t a = 0; a < 3; ++a) shape.scale[a] = scaleBefore(a);
    shape.rotation = onLattice(shape);
    return shape;
  }

  /// The predicted rotation, as codes with the bits that they have for the scales of a shape.
  [[nodiscard]] RotationCodes onLattice(const Shape& shape) const {
    const auto middle = rotationMiddle();
    const CoarseScales s = coarseOf(shape.scale, finerScaleBits());
    const int precision = before_.precision[p_];
    RotationCodes codes{};
    for (std::size_t a = 0; a < 3; ++a) codes[a] = std::uint16_t(middle[a]);
    const AxisBits bits = rotationBits(lattice_, precision, s, codes);
    for (std::size_t a = 0; a < 3; ++a) codes[a] = truncated(codes[a], bits[a]);
    return codes;
  }

  template <class AnySide>
  Shape code(AnySide& side, const Shape& wanted) {
    Shape coded;
    std::size_t activity = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      coded.scale[a] = codeScale(side, a, activity, wanted.scale[a]);
      if (coded.scale[a] != scaleBefore(a)) ++activity;
    }
    coded.rotation = codeRotation(side, activity, coded, wanted.rotation);
    return coded;
  }

  template <class AnySide>
  std::uint32_t codeScale(AnySide& side, std::size_t a, std::size_t activity,
                          std::uint32_t wanted) {
    const int bits = finerScaleBits();
    const auto before = std::int64_t(scaleBefore(a));
    const auto context =
        DifferenceModel::contextOf(expectedScale_[a].mean() >> (kMagnitudeBits - 2 - bits));
    const std::int64_t code =
        before + scales_[a].code(side, context, activity, std::int64_t(wanted) - before);
    requireOnLattice(code >= 0 && (code >> bits) <= std::int64_t(Lattice::kMaxCoarseScale),
                     "a scale");
    return std::uint32_t(code);
  }

  void learn(const Shape& shape) {
    const auto middle = rotationMiddle();
    const int bits = finerScaleBits();
    for (std::size_t a = 0; a < 3; ++a) {
      const auto change = std::abs(std::int64_t(shape.scale[a]) - std::int64_t(scaleBefore(a)));
      if (change != 0) ++changed_;
      expectedScale_[a].learn(std::uint64_t(change) << (kMagnitudeBits - bits));
      const auto turned = std::abs(std::int64_t(shape.rotation[a]) - std::int64_t(middle[a]));
      expectedTurn_[a].learn(std::uint64_t(turned) << (kMagnitudeBits - Lattice::kMaxRotationBits));
    }
  }

 private:
  /// The predicted rotation: the middles of the intervals before, as codes with all bits.
  [[nodiscard]] std::array<std::int32_t, 3> rotationMiddle() const {
    const AxisBits bits = shapeBits(before_, p_).rotation;
    std::array<std::int32_t, 3> middle{};
    for (std::size_t a = 0; a < 3; ++a)
      middle[a] = std::int32_t(before_.rotation[a][p_]) +
                  ((1 << (Lattice::kMaxRotationBits - bits[a])) >> 1);
    return middle;
  }

  /// \param shape  its scales are known
  template <class AnySide>
  RotationCodes codeRotation(AnySide& side, std::size_t activity, const Shape& shape,
                             const RotationCodes& wanted) {
    const int precision = before_.precision[p_];
    const CoarseScales s = coarseOf(shape.scale, finerScaleBits());
    const int coarse = coarseRotationBits(lattice_, precision, s);
    const auto middle = rotationMiddle();
    const auto coarsely = [&](std::int32_t code) { return code >> (kRotationBits - coarse); };
    RotationCodes known{};
    bool same = true;
    for (std::size_t a = 0; a < 3; ++a) same = same && coarsely(wanted[a]) == coarsely(middle[a]);
    same = !side.bit(turns_[activity], !same);
    for (std::size_t a = 0; a < 3; ++a) {
      const auto guess = std::uint32_t(coarsely(middle[a]));
      const std::uint32_t code = same ? guess : side.raw(coarsely(wanted[a]), coarse);
      known[a] = std::uint16_t(code << (kRotationBits - coarse));
    }
    const AxisBits bits = rotationBits(lattice_, precision, s, known);
    for (std::size_t a = 0; a < 3; ++a) {
      const FinerTurn turn{a, bits[a], bits[a] - coarse, std::uint32_t(middle[a])};
      const std::uint32_t rest = same ? codeFinerTurn(side, activity, turn, wanted[a])
                                      : side.raw(turn.restOf(wanted[a]), turn.rest);
      known[a] = std::uint16_t(known[a] | rest << turn.below());
    }
    return known;
  }

  static constexpr int kRotationBits = Lattice::kMaxRotationBits;

  /// The bits of a rotation's component below its coarse bits.
  struct FinerTurn {
    std::size_t axis;
    int bits, rest;        ///< number of all bits, and of these
    std::uint32_t middle;  ///< the predicted code

    [[nodiscard]] int below() const { return kRotationBits - bits; }
    [[nodiscard]] std::uint32_t restOf(std::uint32_t code) const {
      return (code >> below()) & ((1u << rest) - 1u);
    }
  };

  template <class AnySide>
  std::uint32_t codeFinerTurn(AnySide& side, std::size_t& activity, const FinerTurn& turn,
                              std::uint32_t wanted) {
    const auto guess = std::int64_t(turn.restOf(turn.middle));
    const auto context = DifferenceModel::contextOf(expectedTurn_[turn.axis].mean() >>
                                                    (kMagnitudeBits - 2 - turn.bits));
    const std::int64_t found =
        guess +
        turn_[turn.axis].code(side, context, activity, std::int64_t(turn.restOf(wanted)) - guess);
    requireOnLattice(found >= 0 && found < (std::int64_t{1} << turn.rest), "a rotation");
    if (found != guess && activity + 1 < DifferenceModel::kActivities) ++activity;
    return std::uint32_t(found);
  }

  const QuantisedEllipsoids& before_;
  const Lattice& lattice_;   ///< that of this frame
  std::size_t p_ = 0;        ///< the ellipsoid of the previous frame that is continued
  std::size_t changed_ = 0;  ///< see changedScales()
  std::array<DifferenceModel, 3> scales_, turn_;
  std::array<BitModel, DifferenceModel::kActivities> turns_;
  std::array<ExpectedMagnitude, 3> expectedScale_{ExpectedMagnitude(kFirstExpected),
                                                  ExpectedMagnitude(kFirstExpected),
                                                  ExpectedMagnitude(kFirstExpected)},
      expectedTurn_{expectedScale_};
};

}  // namespace esvr::codec
