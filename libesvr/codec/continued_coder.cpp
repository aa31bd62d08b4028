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
#include "codec/continued_shapes.h"
#include "codec/difference_model.h"
#include "codec/lattice_bits.h"
#include "codec/motion_predictor.h"
#include "codec/rounding.h"
#include "codec/shape_choice.h"
#include "codec/thrifty_code.h"
#include "esvr/error.h"

namespace esvr::codec {
namespace {

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

template <class Side>
class ContinuedCoder {
 public:
  ContinuedCoder(const QuantisedEllipsoids& before, QuantisedEllipsoids& now,
                 const ContinuedThrift* thrift = nullptr)
      : before_(before),
        now_(now),
        places_(placesOf(before, now.lattice)),
        motion_(places_),
        shapes_(before, now.lattice),
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
    shapes_.look(p);
    now_.precision[i] = before_.precision[p];
    shape(side, i);
    position(side, i);
    intensity(side, i);
  }

  // ---- Shapes

  void shape(Side& side, std::size_t i) {
    Shape wanted;
    if (thrift_ && thrift_->shapes)
      wanted = ShapeChoice(shapes_, *thrift_->shapes, thrift_->bitPrice).cheapest(i);
    else if constexpr (!kReads)
      wanted = {scaleCodes(now_, i), rotationCodes(now_, i)};
    const Shape coded = shapes_.code(side, wanted);
    shapes_.learn(coded);
    for (std::size_t a = 0; a < 3; ++a) {
      now_.scale[a][i] = coded.scale[a];
      now_.rotation[a][i] = coded.rotation[a];
    }
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
      wanted = std::clamp<std::int64_t>(
          thriftyCode(rounding->wanted(a, bits), guess, thrift_->bitPrice, codeIt), 0, last);
      rounding->rounded(a, bits, wanted);
    }
    const std::int64_t code = codeIt(side, wanted);
    requireOnLattice(code >= 0 && code <= last, "a center");
    return std::uint32_t(code);
  }

  /// How much of the shape has changed, as a context.
  [[nodiscard]] std::size_t activity() const {
    return std::min(shapes_.changedScales(), DifferenceModel::kActivities - 1);
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
    requireOnLattice(code >= 0 && code <= std::int64_t(Lattice::kMaxIntensity), "an intensity");
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
    const auto code = std::int32_t(std::min(thriftyCode(steps, guess, thrift_->bitPrice, codeIt),
                                            std::int64_t(Lattice::kMaxIntensity)));
    return negative ? -1 - code : code;
  }

  const QuantisedEllipsoids& before_;
  QuantisedEllipsoids& now_;
  std::vector<Vector64> places_;  ///< those of the previous frame, on the lattice of this one
  MotionPredictor motion_;
  ContinuedShapes shapes_;
  const ContinuedThrift* thrift_;
  std::size_t p_ = 0;  ///< the ellipsoid of the previous frame that is continued
  std::array<BitModel, kPrecisions> goesOn_;
  std::array<DifferenceModel, 3> positions_;
  DifferenceModel intensities_;
  BitModel changesSign_;
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
