#include "codec/continued_coder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "codec/code_values.h"
#include "codec/difference_model.h"
#include "codec/lattice_bits.h"
#include "codec/motion_predictor.h"
#include "codec/nearest_axes.h"
#include "codec/rounding.h"
#include "esvr/error.h"

namespace esvr::codec {
namespace {

/// Expected magnitude before the first difference.
constexpr std::uint64_t kFirstExpected = std::uint64_t{1} << (kMagnitudeBits - 2);

/// Twice the place in a lattice of 2^bits codes in a cell, as an odd number of half codes.
std::int64_t placeOf(std::uint32_t code, int bits) {
  return (2 * std::int64_t(code) + 1) << (Lattice::kMaxPositionBits - bits);
}

std::array<std::int64_t, 3> lowestOf(const Lattice& lattice) {
  return {lattice.lowestCell.x, lattice.lowestCell.y, lattice.lowestCell.z};
}

/// The places of ellipsoids relative to the lowest cell of another lattice.
std::vector<Vector64> placesOf(const QuantisedEllipsoids& q, const Lattice& lattice) {
  const auto own = lowestOf(q.lattice), other = lowestOf(lattice);
  std::vector<Vector64> places(q.size());
  for (std::size_t i = 0; i < q.size(); ++i) {
    const AxisBits bits = shapeBits(q, i).position;
    for (std::size_t a = 0; a < 3; ++a)
      places[i][a] = placeOf(q.position[a][i], bits[a]) + ((own[a] - other[a]) << kUnitBits);
  }
  return places;
}

void require(bool holds, const char* what) {
  if (!holds) throw BadInput(std::string(what) + " lies outside the lattice");
}

/// The codes of an ellipsoid's shape.
struct Shape {
  std::array<std::uint32_t, 3> scale{};
  RotationCodes rotation{};
};

template <class Side>
class ContinuedCoder {
 public:
  ContinuedCoder(const QuantisedEllipsoids& before, QuantisedEllipsoids& now,
                 const ContinuedThrift* thrift = nullptr)
      : before_(before),
        now_(now),
        places_(placesOf(before, now.lattice)),
        motion_(places_),
        thrift_(thrift) {}

  void code(Side& side) {
    for (auto& motion : now_.motion) motion.resize(kReads ? 0 : now_.continues.size());
    std::size_t i = 0;
    for (std::size_t p = 0; p < before_.size(); ++p) {
      const bool goesOn = !kReads && i < now_.continues.size() && now_.continues[i] == p;
      auto& model = goesOn_[std::min<std::size_t>(before_.precision[p], kPrecisions - 1)];
      if (!side.bit(model, goesOn)) continue;
      if constexpr (kReads) append(p);
      ellipsoid(side, p, i++);
    }
  }

 private:
  static constexpr bool kReads = std::is_same_v<Side, Reader>;
  static constexpr std::size_t kPrecisions = Lattice::kMaxPrecision + 1;

  void append(std::size_t p) {
    now_.continues.push_back(std::uint32_t(p));
    for (auto& motion : now_.motion) motion.push_back(0);
    now_.resize(now_.continues.size());
  }

  void ellipsoid(Side& side, std::size_t p, std::size_t i) {
    p_ = p;
    now_.precision[i] = before_.precision[p];
    shape(side, i);
    position(side, i);
    intensity(side, i);
  }

  // ---- Shapes

  void shape(Side& side, std::size_t i) {
    Shape wanted;
    if (thrift_ && thrift_->shapes)
      wanted = cheapestShape(i);
    else if constexpr (!kReads)
      wanted = {scaleCodes(now_, i), rotationCodes(now_, i)};
    active_ = 0;
    const Shape coded = codeShape(side, wanted);
    learnShape(coded);
    for (std::size_t a = 0; a < 3; ++a) {
      now_.scale[a][i] = coded.scale[a];
      now_.rotation[a][i] = coded.rotation[a];
    }
  }

  [[nodiscard]] int finerScaleBits() const {
    return scaleBits(now_.lattice, before_.precision[p_]);
  }

  /// The code of a scale of the previous frame on the lattice of this one: the middle of its
  /// interval, rounded down.
  [[nodiscard]] std::uint32_t scaleBefore(std::size_t a) const {
    const int more = finerScaleBits() - scaleBits(before_.lattice, before_.precision[p_]);
    const std::uint32_t code = before_.scale[a][p_];
    if (more <= 0) return code >> -more;
    return (code << more) + (1u << (more - 1));
  }

  /// The shape of the previous frame on the lattice of this one.
  [[nodiscard]] Shape shapeBefore() const {
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
    const AxisBits bits = rotationBits(now_.lattice, precision, s, codes);
    for (std::size_t a = 0; a < 3; ++a) codes[a] = truncated(codes[a], bits[a]);
    return codes;
  }

  /// The predicted rotation: the middles of the intervals before, as codes with all bits.
  [[nodiscard]] std::array<std::int32_t, 3> rotationMiddle() const {
    const AxisBits bits = shapeBits(before_, p_).rotation;
    std::array<std::int32_t, 3> middle{};
    for (std::size_t a = 0; a < 3; ++a)
      middle[a] = std::int32_t(before_.rotation[a][p_]) +
                  ((1 << (Lattice::kMaxRotationBits - bits[a])) >> 1);
    return middle;
  }

  template <class AnySide>
  Shape codeShape(AnySide& side, const Shape& wanted) {
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
    require(code >= 0 && (code >> bits) <= std::int64_t(Lattice::kMaxCoarseScale), "a scale");
    return std::uint32_t(code);
  }

  /// \param shape  its scales are known
  template <class AnySide>
  RotationCodes codeRotation(AnySide& side, std::size_t activity, const Shape& shape,
                             const RotationCodes& wanted) {
    const int precision = before_.precision[p_];
    const CoarseScales s = coarseOf(shape.scale, finerScaleBits());
    const int coarse = coarseRotationBits(now_.lattice, precision, s);
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
    const AxisBits bits = rotationBits(now_.lattice, precision, s, known);
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
    require(found >= 0 && found < (std::int64_t{1} << turn.rest), "a rotation");
    if (found != guess && activity + 1 < DifferenceModel::kActivities) ++activity;
    return std::uint32_t(found);
  }

  void learnShape(const Shape& shape) {
    const auto middle = rotationMiddle();
    const int bits = finerScaleBits();
    for (std::size_t a = 0; a < 3; ++a) {
      const auto change = std::abs(std::int64_t(shape.scale[a]) - std::int64_t(scaleBefore(a)));
      if (change != 0) ++active_;
      expectedScale_[a].learn(std::uint64_t(change) << (kMagnitudeBits - bits));
      const auto turned = std::abs(std::int64_t(shape.rotation[a]) - std::int64_t(middle[a]));
      expectedTurn_[a].learn(std::uint64_t(turned) << (kMagnitudeBits - Lattice::kMaxRotationBits));
    }
  }

  // ---- The choice of shapes

  [[nodiscard]] Shape cheapestShape(std::size_t i) {
    const NearestAxes exact(*thrift_->shapes, i, quaternionBefore());
    const double stepLog = now_.lattice.scaleStep * std::ldexp(1.0, -finerScaleBits());
    Shape best;
    double least = HUGE_VAL;
    const auto consider = [&](const Shape& shape) {
      BitMeter meter;
      (void)codeShape(meter, shape);
      const double cost =
          errorOf(exact, shape) / (stepLog * stepLog) + thrift_->bitPrice * meter.bits;
      if (cost < least) least = cost, best = shape;
    };
    consider(shapeBefore());
    consider(withRotationBefore(exact));
    consider(nearestShape(exact));
    return best;
  }

  [[nodiscard]] Quaternion quaternionBefore() const {
    return quaternionOf(rotationCodes(before_, p_), shapeBits(before_, p_).rotation);
  }

  /// The squared error of a shape, as the sum of squares of the errors of logarithms of scales.
  [[nodiscard]] double errorOf(const NearestAxes& exact, const Shape& shape) const {
    const CoarseScales s = coarseOf(shape.scale, finerScaleBits());
    const AxisBits bits = rotationBits(now_.lattice, before_.precision[p_], s, shape.rotation);
    return exact.squaredError(logScalesOf(now_.lattice, finerScaleBits(), shape.scale),
                              quaternionOf(shape.rotation, bits));
  }

  /// Rounds scales, the smallest first, each relative to the rounded one before.
  [[nodiscard]] std::array<std::uint32_t, 3> roundedScales(const std::array<double, 3>& logs) {
    const int bits = finerScaleBits();
    std::array<std::uint32_t, 3> codes{};
    double below = double(now_.lattice.lowestScale);
    for (std::size_t a = 0; a < 3; ++a) {
      const double steps = (logs[2 - a] / now_.lattice.scaleStep - below) * std::ldexp(1.0, bits);
      codes[a] = thriftyScale(a, steps - 0.5);
      below += middleOfCode(codes[a], bits);
    }
    return codes;
  }

  [[nodiscard]] std::uint32_t thriftyScale(std::size_t a, double exact) {
    const double last = std::ldexp(double(Lattice::kMaxCoarseScale) + 1.0, finerScaleBits()) - 1.0;
    if (!(exact <= last)) throw RuntimeFailure("cannot quantise: a scale lies outside the lattice");
    return std::uint32_t(thrifty(std::max(exact, 0.0), std::int64_t(scaleBefore(a)),
                                 [&](auto& meter, std::int64_t code) {
                                   (void)codeScale(meter, a, 0, std::uint32_t(code));
                                 }));
  }

  [[nodiscard]] Shape withRotationBefore(const NearestAxes& exact) {
    Shape shape;
    shape.scale = roundedScales(exact.logScalesAlong(quaternionBefore()));
    shape.rotation = onLattice(shape);
    return shape;
  }

  /// The shape with the rounded exact rotation. As in quantise(), the coarse bits of a component are
  /// rounded down, and the others are rounded one component after the other (rounding.h).
  [[nodiscard]] Shape nearestShape(const NearestAxes& exact) {
    Shape shape;
    shape.scale = roundedScales(exact.axes().logScale);
    const CoarseScales s = coarseOf(shape.scale, finerScaleBits());
    const int precision = before_.precision[p_];
    const int coarse = coarseRotationBits(now_.lattice, precision, s);
    const auto places = rotationPlaces(exact.axes());
    for (std::size_t a = 0; a < 3; ++a)
      shape.rotation[a] = truncated(std::uint32_t(places[a]), coarse);
    const AxisBits bits = rotationBits(now_.lattice, precision, s, shape.rotation);
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

  /// The first bits of a code of a rotation's component; the others are 0.
  static std::uint16_t truncated(std::uint32_t code, int bits) {
    const int below = kRotationBits - bits;
    return std::uint16_t((code >> below) << below);
  }

  /// The code with the least cost: the one nearest to the exact value, the ones next to it towards
  /// the guess, or the guess itself.
  template <class CodeIt>
  [[nodiscard]] std::int64_t thrifty(double exact, std::int64_t guess, const CodeIt& codeIt) {
    const auto nearest = std::int64_t(std::llround(exact));
    if (thrift_->bitPrice <= 0.0 || guess == nearest) return nearest;
    std::int64_t best = nearest;
    double least = HUGE_VAL;
    const auto consider = [&](std::int64_t code) {
      BitMeter meter;
      codeIt(meter, code);
      const double error = double(code) - exact;
      const double cost = error * error + thrift_->bitPrice * meter.bits;
      if (cost < least) least = cost, best = code;
    };
    const std::int64_t step = guess > nearest ? 1 : -1;
    consider(nearest);
    if (nearest + step != guess) consider(nearest + step);
    if (std::abs(double(guess) - exact) < kFarthestGuess) consider(guess);
    return best;
  }

  // ---- Positions

  void position(Side& side, std::size_t i) {
    const Vector64& from = places_[p_];
    motion_.look(from, motionBefore());
    const AxisBits bits = shapeBits(now_, i).position;
    std::optional<Rounding> rounding;
    if (thrift_ && thrift_->shapes) rounding.emplace(*thrift_->shapes, i, now_.lattice);
    std::array<std::int32_t, 3> moved{};
    for (std::size_t a = 0; a < 3; ++a) {
      const std::uint32_t code = codeCoordinate(side, a, bits[a], i, rounding);
      now_.position[a][i] = code;
      moved[a] = std::int32_t((placeOf(code, bits[a]) - from[a]) >> (kUnitBits - kMotionBits));
      now_.motion[a][i] = moved[a];
    }
    motion_.learn(from, moved);
  }

  /// The motion to the previous frame; 0 if the ellipsoid was new there.
  [[nodiscard]] std::array<std::int32_t, 3> motionBefore() const {
    std::array<std::int32_t, 3> motion{};
    for (std::size_t a = 0; a < 3; ++a)
      if (p_ < before_.motion[a].size()) motion[a] = before_.motion[a][p_];
    return motion;
  }

  class Rounding;

  std::uint32_t codeCoordinate(Side& side, std::size_t a, int bits, std::size_t i,
                               std::optional<Rounding>& rounding) {
    const std::int64_t last = (std::int64_t{1} << (now_.lattice.cellBits + bits)) - 1;
    const std::int64_t guess = std::clamp<std::int64_t>(
        (places_[p_][a] + motion_.motion(a)) >> (kUnitBits - bits), 0, last);
    const auto context =
        DifferenceModel::contextOf((motion_.expected() << 2) >> (kMagnitudeBits - bits));
    const auto codeIt = [&](auto& any, std::int64_t code) {
      return guess + positions_[a].code(any, context, activity(), code - guess);
    };
    auto wanted = std::int64_t(now_.position[a][i]);
    if (rounding) {
      wanted = std::clamp<std::int64_t>(thrifty(rounding->wanted(a, bits), guess, codeIt), 0, last);
      rounding->rounded(a, bits, wanted);
    }
    const std::int64_t code = codeIt(side, wanted);
    require(code >= 0 && code <= last, "a center");
    return std::uint32_t(code);
  }

  /// How much of the shape has changed, as a context.
  [[nodiscard]] std::size_t activity() const {
    return std::min(active_, DifferenceModel::kActivities - 1);
  }

  /// Rounds the coordinates of a center one after the other (rounding.h).
  class Rounding {
   public:
    Rounding(const Ellipsoids& e, std::size_t i, const Lattice& lattice)
        : errors_(centerErrors(sortedAxes(e, i))) {
      const auto low = lowestOf(lattice);
      for (std::size_t a = 0; a < 3; ++a)
        cells_[a] = e.center[a][i] / lattice.cell - double(low[a]);
    }
    /// The place between codes that a coordinate is to be near.
    [[nodiscard]] double wanted(std::size_t a, int bits) const {
      return std::ldexp(cells_[a] + errors_.shift(a, error_), bits) - 0.5;
    }
    void rounded(std::size_t a, int bits, std::int64_t code) {
      error_[a] = std::ldexp(double(code) + 0.5, -bits) - cells_[a];
    }

   private:
    CoupledErrors errors_;
    std::array<double, 3> cells_{}, error_{};
  };

  // ---- Intensities

  [[nodiscard]] static std::uint32_t magnitudeOf(std::int32_t code) {
    return std::uint32_t(code < 0 ? -1 - code : code);
  }

  void intensity(Side& side, std::size_t i) {
    const int shift = intensityShift(now_.lattice, coarseScales(now_, i));
    const int shiftBefore = intensityShift(before_.lattice, coarseScales(before_, p_));
    const std::int32_t before = before_.intensity[p_];
    const auto guess =
        std::int64_t(((2 * std::uint64_t(magnitudeOf(before)) + 1) << shift) >> (shiftBefore + 1));
    const auto context = DifferenceModel::contextOf(
        (expectedIntensity_.mean() * std::uint64_t(guess + 1)) >> (kMagnitudeBits - 2));
    const auto codeIt = [&](auto& any, std::int64_t code) {
      return guess + intensities_.code(any, context, activity(), code - guess);
    };
    std::int32_t wanted = now_.intensity[i];
    if (thrift_) wanted = chosenIntensity(thrift_->intensities[i], shift, guess, codeIt);
    bool negative = wanted < 0;
    if (now_.lattice.signedIntensity)
      negative = side.bit(changesSign_, negative != (before < 0)) != (before < 0);
    const std::int64_t code = codeIt(side, std::int64_t(magnitudeOf(wanted)));
    require(code >= 0 && code <= std::int64_t(Lattice::kMaxIntensity), "an intensity");
    now_.intensity[i] = negative ? -1 - std::int32_t(code) : std::int32_t(code);
    expectedIntensity_.learn((std::uint64_t(std::abs(code - guess)) << kMagnitudeBits) /
                             std::uint64_t(guess + 1));
  }

  template <class CodeIt>
  [[nodiscard]] std::int32_t chosenIntensity(float exact, int shift, std::int64_t guess,
                                             const CodeIt& codeIt) {
    const bool negative = now_.lattice.signedIntensity && exact < 0.0f;
    const double magnitude =
        (negative || exact > 0.0f ? std::abs(double(exact)) : 0.0) / now_.lattice.intensityStep;
    const double steps =
        std::clamp(std::ldexp(magnitude, shift) - 0.5, 0.0, double(Lattice::kMaxIntensity));
    const auto code =
        std::int32_t(std::min(thrifty(steps, guess, codeIt), std::int64_t(Lattice::kMaxIntensity)));
    return negative ? -1 - code : code;
  }

  static constexpr double kFarthestGuess = 4.0;  // steps up to which the guess itself is considered

  const QuantisedEllipsoids& before_;
  QuantisedEllipsoids& now_;
  std::vector<Vector64> places_;  ///< those of the previous frame, on the lattice of this one
  MotionPredictor motion_;
  const ContinuedThrift* thrift_;
  std::size_t p_ = 0;       ///< the ellipsoid of the previous frame that is continued
  std::size_t active_ = 0;  ///< number of its scales that changed
  std::array<BitModel, kPrecisions> goesOn_;
  std::array<DifferenceModel, 3> scales_, turn_, positions_;
  DifferenceModel intensities_;
  std::array<BitModel, DifferenceModel::kActivities> turns_;
  BitModel changesSign_;
  std::array<ExpectedMagnitude, 3> expectedScale_{ExpectedMagnitude(kFirstExpected),
                                                  ExpectedMagnitude(kFirstExpected),
                                                  ExpectedMagnitude(kFirstExpected)},
      expectedTurn_{expectedScale_};
  ExpectedMagnitude expectedIntensity_{kFirstExpected};
};

template <class Side>
void code(Side& side, const QuantisedEllipsoids& before, QuantisedEllipsoids& now,
          const ContinuedThrift* thrift = nullptr) {
  std::make_unique<ContinuedCoder<Side>>(before, now, thrift)->code(side);
}

}  // namespace

Lattice refined(const Lattice& lattice, int octaves) {
  constexpr int kOctave = 256;  // bases are in units of 1/256
  Lattice result = lattice;
  result.scaleOffset -= octaves;
  result.rotationOffset += octaves;
  result.positionBase += kOctave * octaves;
  result.intensityBase += kOctave * octaves;
  return result;
}

std::optional<int> refinementOf(const Lattice& lattice, const Lattice& before) {
  const int octaves = before.scaleOffset - lattice.scaleOffset;
  if (std::abs(octaves) > kMaxRefinement) return std::nullopt;
  const auto own = lowestOf(lattice), other = lowestOf(before);
  for (std::size_t a = 0; a < 3; ++a)
    if (std::abs(own[a] - other[a]) > kMaxCellShift) return std::nullopt;
  Lattice expected = refined(before, octaves);
  expected.lowestCell = lattice.lowestCell;
  expected.cellBits = lattice.cellBits;
  return lattice == expected ? std::optional(octaves) : std::nullopt;
}

void codeContinued(Writer& side, const QuantisedEllipsoids& before, QuantisedEllipsoids& now) {
  code(side, before, now);
}

void codeContinued(Reader& side, const QuantisedEllipsoids& before, QuantisedEllipsoids& now) {
  code(side, before, now);
}

void chooseContinued(const QuantisedEllipsoids& before, const ContinuedThrift& thrift,
                     QuantisedEllipsoids& now) {
  Writer writer;
  code(writer, before, now, &thrift);
}

}  // namespace esvr::codec
