// Plan: codes of random frames come back, whatever is continued, with other cells and with motions
// before. Chosen codes are as near as those of quantise(), and a price of bits trades error for
// bytes. A reader of any bytes gets codes of the lattice or refuses them.

#include "codec/continued_coder.h"

#include <gtest/gtest.h>

#include <cmath>

#include "codec/continued_frames.h"
#include "codec/lattice_bits.h"
#include "codec/nearest_axes.h"
#include "codec/rounding.h"
#include "esvr/error.h"

namespace esvr::codec {
namespace {

using test::allOf;
using test::Change;
using test::firstFrame;
using test::frameAfter;
using test::mostOf;

std::vector<std::byte> bytesOf(const QuantisedEllipsoids& before, QuantisedEllipsoids& now) {
  Writer writer;
  codeContinued(writer, before, now);
  return writer.coder.finish();
}

QuantisedEllipsoids readBack(std::span<const std::byte> bytes, const QuantisedEllipsoids& before,
                             const Lattice& lattice) {
  QuantisedEllipsoids now;
  now.lattice = lattice;
  Reader reader{RangeDecoder(bytes)};
  codeContinued(reader, before, now);
  return now;
}

/// \return the number of bytes
std::size_t expectComesBack(const QuantisedEllipsoids& before, QuantisedEllipsoids now) {
  const QuantisedEllipsoids wanted = now;
  const auto bytes = bytesOf(before, now);
  const QuantisedEllipsoids back = readBack(bytes, before, now.lattice);
  EXPECT_EQ(back, now);  // with motions
  EXPECT_EQ(back.position, wanted.position);
  EXPECT_EQ(back.scale, wanted.scale);
  EXPECT_EQ(back.rotation, wanted.rotation);
  EXPECT_EQ(back.intensity, wanted.intensity);
  return bytes.size();
}

TEST(ContinuedCoder, BringsBackFramesOfAnyPart) {
  for (const bool bothSigns : {false, true}) {
    const QuantisedEllipsoids before = firstFrame(400, bothSigns);
    for (const auto& continues :
         {allOf(before), mostOf(before, 7), mostOf(before, 2), {0u}, {399u}, {}})
      (void)expectComesBack(before, frameAfter(before, continues));
  }
}

TEST(ContinuedCoder, BringsBackLargeAndSmallChanges) {
  const QuantisedEllipsoids before = firstFrame(300, true);
  for (const double size : {0.0, 0.01, 0.3, 1.0})
    (void)expectComesBack(
        before, frameAfter(before, allOf(before),
                           {.motion = 40.0 * size, .scale = size, .turn = size, .value = size}));
}

TEST(ContinuedCoder, BringsBackASignThatChanges) {
  const QuantisedEllipsoids before = firstFrame(100, true);
  ASSERT_TRUE(before.lattice.signedIntensity);
  QuantisedEllipsoids now = frameAfter(before, allOf(before));
  for (std::size_t i = 0; i < now.size(); i += 3) now.intensity[i] = -1 - now.intensity[i];
  (void)expectComesBack(before, now);
}

TEST(ContinuedCoder, BringsBackOtherCells) {
  const QuantisedEllipsoids before = firstFrame(300);
  const Lattice moved = test::withMovedCells(before.lattice);
  ASSERT_EQ(refinementOf(moved, before.lattice), 0);
  const QuantisedEllipsoids now = frameAfter(before, mostOf(before, 9), {}, moved);
  (void)expectComesBack(before, now);
  (void)expectComesBack(now, frameAfter(now, mostOf(now, 9), {}, before.lattice));
}

/// The motions are those of the centers, in 1/256 of a cell.
TEST(ContinuedCoder, SetsTheMotions) {
  const QuantisedEllipsoids before = firstFrame(200);
  QuantisedEllipsoids now =
      frameAfter(before, mostOf(before, 5), {.drift = 1.0}, test::withMovedCells(before.lattice));
  (void)bytesOf(before, now);
  const Ellipsoids old = dequantise(before), e = dequantise(now);
  for (std::size_t i = 0; i < now.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a) {
      const double moved = double(e.center[a][i]) - old.center[a][now.continues[i]];
      // It is rounded down; float32 centers of up to 64 have errors of 4e-6.
      EXPECT_NEAR(now.motion[a][i], std::floor(moved / now.lattice.cell * 256.0), 1.0);
    }
}

/// Each ellipsoid keeps to a motion of its own, which only the frame before can tell.
TEST(ContinuedCoder, TakesFewerBytesWhereMotionsGoOn) {
  const QuantisedEllipsoids first = firstFrame(1000);
  const Change still{.motion = 0.0, .scale = 0.0, .turn = 0.0, .value = 0.0};
  QuantisedEllipsoids second =
      frameAfter(first, allOf(first), {.motion = 2.0, .scale = 0.0, .turn = 0.0, .value = 0.0});
  (void)bytesOf(first, second);
  QuantisedEllipsoids third = frameAfter(second, allOf(second), still);
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t i = 0; i < third.size(); ++i) {
      const std::int64_t bits = shapeBits(third, i).position[a];
      const std::int64_t next =
          2 * std::int64_t(second.position[a][i]) - std::int64_t(first.position[a][i]);
      third.position[a][i] = std::uint32_t(std::clamp<std::int64_t>(
          next, 0, (std::int64_t{1} << (third.lattice.cellBits + bits)) - 1));
    }
  const std::size_t withMotion = expectComesBack(second, third);
  QuantisedEllipsoids forgetful = second;
  forgetful.motion = {};
  EXPECT_LT(2 * withMotion, expectComesBack(forgetful, third));
}

/// Every decision is a 0 of a model that learns it. Learning takes about log2(100) + 3 = 10 bits for
/// each model: 16 of precisions, a turn, and one for each context of the 10 numbers that are coded.
TEST(ContinuedCoder, TakesNearlyNothingForEllipsoidsThatDidNotChange) {
  const QuantisedEllipsoids before = firstFrame(4000);
  QuantisedEllipsoids now = before;
  now.continues = allOf(before);
  EXPECT_LT(8 * expectComesBack(before, now), 10 * (16 + 1 + 10 * 12) + 32);
}

TEST(ContinuedCoder, BringsBackFinerAndCoarserSteps) {
  const QuantisedEllipsoids before = firstFrame(300);
  for (int octaves = -kMaxRefinement; octaves <= kMaxRefinement; ++octaves)
    (void)expectComesBack(
        before, frameAfter(before, mostOf(before, 9), {}, refined(before.lattice, octaves)));
}

TEST(ContinuedCoder, LatticesDifferByCellsAndOctavesOfSteps) {
  const Lattice lattice = firstFrame(50).lattice;
  for (int octaves = -kMaxRefinement; octaves <= kMaxRefinement; ++octaves)
    EXPECT_EQ(refinementOf(test::withMovedCells(refined(lattice, octaves)), lattice), octaves);
  Lattice other = lattice;
  other.scaleStep *= 1.5;
  EXPECT_FALSE(refinementOf(other, lattice));
  other = lattice;
  other.signedIntensity = !lattice.signedIntensity;
  EXPECT_FALSE(refinementOf(other, lattice));
  other = lattice;
  other.lowestCell.y += std::int32_t(kMaxCellShift) + 1;
  EXPECT_FALSE(refinementOf(other, lattice));
}

// ---- The choice of codes

struct Chosen {
  Ellipsoids exact;
  QuantisedEllipsoids q;
};

Chosen chosenFor(const QuantisedEllipsoids& before, double bitPrice, const Change& change = {}) {
  Chosen chosen;
  chosen.q.continues = mostOf(before, 11);
  chosen.q.lattice = before.lattice;
  chosen.q.resize(chosen.q.continues.size());
  chosen.exact = test::movedFrom(before, chosen.q.continues, change);
  chooseContinued(before, {&chosen.exact, chosen.exact.intensity, bitPrice}, chosen.q);
  return chosen;
}

/// The squared errors of shapes and intensities, and those of centers relative to the ellipsoids.
struct Errors {
  double shape = 0.0, center = 0.0, intensity = 0.0;
};

/// |S^-1 R^T d|^2 of an ellipsoid.
double squaredIn(const SortedAxes& axes, const std::array<double, 3>& d) {
  const Matrix3 r = rotationOf(axes.rotation);
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double along = r[k] * d[0] + r[3 + k] * d[1] + r[6 + k] * d[2];
    sum += std::pow(along * std::exp(-axes.logScale[k]), 2.0);
  }
  return sum;
}

Errors errorsOf(const QuantisedEllipsoids& q, const Ellipsoids& exact) {
  const Ellipsoids back = dequantise(q);
  Errors sum;
  for (std::size_t i = 0; i < q.size(); ++i) {
    const Quaternion rotation{back.rotation[0][i], back.rotation[1][i], back.rotation[2][i],
                              back.rotation[3][i]};
    const NearestAxes axes(exact, i, rotation);
    sum.shape += axes.squaredError({back.logScale[0][i], back.logScale[1][i], back.logScale[2][i]},
                                   rotation);
    std::array<double, 3> d{};
    for (std::size_t a = 0; a < 3; ++a) d[a] = double(back.center[a][i]) - exact.center[a][i];
    sum.center += squaredIn(axes.axes(), d);
    sum.intensity += std::pow(double(back.intensity[i]) - exact.intensity[i], 2.0);
  }
  return sum;
}

TEST(ChooseContinued, TakesTheNearestPlaceAndIntensityIfBitsAreFree) {
  const QuantisedEllipsoids before = firstFrame(500, true);
  const auto [exact, q] = chosenFor(before, 0.0);
  const Ellipsoids back = dequantise(q);
  std::size_t atTheEdge = 0;
  for (std::size_t i = 0; i < q.size(); ++i) {
    const CoupledErrors errors = centerErrors(sortedAxes(exact, i));
    const AxisBits bits = shapeBits(q, i).position;
    std::array<double, 3> error{};
    for (std::size_t a = 0; a < 3; ++a) {
      error[a] = double(back.center[a][i]) - exact.center[a][i];
      const std::uint32_t last = (1u << (q.lattice.cellBits + bits[a])) - 1;
      if (q.position[a][i] == 0 || q.position[a][i] == last)
        ++atTheEdge;  // the lattice ends there
      else
        // Half a step. Float32 centers of up to 64 have errors of 4e-6 each, which shifts of up to
        // the squared aspect, 36, multiply.
        EXPECT_NEAR(error[a], errors.shift(a, error),
                    std::ldexp(0.5 * q.lattice.cell, -bits[a]) + 36 * 8e-6);
    }
    const double step =
        std::ldexp(0.5 * q.lattice.intensityStep, -intensityShift(q.lattice, coarseScales(q, i)));
    EXPECT_NEAR(back.intensity[i], exact.intensity[i], step * (1.0 + 1e-5));
  }
  EXPECT_LT(atTheEdge, 40u);  // of 1500
}

/// quantise() rounds each shape to the nearest one of the lattice. The coder considers the same shape
/// after another half turn, whose rounding errors are others of the same size, and two more.
TEST(ChooseContinued, TakesShapesAsNearAsThoseOfQuantiseIfBitsAreFree) {
  const QuantisedEllipsoids before = firstFrame(1500);
  const auto [exact, q] = chosenFor(before, 0.0);
  LatticeChoice choice{q.lattice, q.precision};
  const Errors nearest = errorsOf(test::quantisedInOrder(exact, choice), exact);
  EXPECT_LT(errorsOf(q, exact).shape, 1.05 * nearest.shape);
}

TEST(ChooseContinued, TradesErrorForBytes) {
  const QuantisedEllipsoids before = firstFrame(1000);
  std::size_t bytesBefore = 0;
  Errors errorsBefore;
  for (const double price : {0.0, 0.05, 0.5, 3.0}) {
    auto [exact, q] = chosenFor(before, price);
    const std::size_t bytes = expectComesBack(before, q);
    const Errors errors = errorsOf(q, exact);
    if (price > 0.0) {
      EXPECT_LT(bytes, bytesBefore) << price;
      EXPECT_GT(errors.shape, errorsBefore.shape) << price;
      EXPECT_GT(errors.center, errorsBefore.center) << price;
      EXPECT_GT(errors.intensity, errorsBefore.intensity) << price;
    }
    bytesBefore = bytes, errorsBefore = errors;
  }
}

TEST(ChooseContinued, KeepsShapesIfItGetsIntensitiesOnly) {
  const QuantisedEllipsoids before = firstFrame(300);
  auto [exact, q] = chosenFor(before, 0.5);
  QuantisedEllipsoids again = q;
  std::vector<float> doubled = exact.intensity;
  for (float& intensity : doubled) intensity *= 2.0f;
  chooseContinued(before, {nullptr, doubled, 0.0}, again);
  EXPECT_EQ(again.position, q.position);
  EXPECT_EQ(again.scale, q.scale);
  EXPECT_EQ(again.rotation, q.rotation);
  EXPECT_NE(again.intensity, q.intensity);
}

TEST(ChooseContinued, RefusesAScaleOutsideTheLattice) {
  const QuantisedEllipsoids before = firstFrame(20);
  QuantisedEllipsoids q;
  q.continues = allOf(before);
  q.lattice = before.lattice;
  q.resize(q.continues.size());
  Ellipsoids exact = dequantise(before);
  exact.logScale[1][5] = float(5000.0 * q.lattice.scaleStep);
  EXPECT_THROW(chooseContinued(before, {&exact, exact.intensity, 0.0}, q), RuntimeFailure);
}

// ---- Damage

/// Codes are of the lattice, and the coder brings them back.
void expectValid(const QuantisedEllipsoids& q, const QuantisedEllipsoids& before) {
  for (std::size_t i = 0; i < q.size(); ++i) {
    ASSERT_LT(q.continues[i], before.size());
    ASSERT_TRUE(i == 0 || q.continues[i - 1] < q.continues[i]);
    const auto [rotation, position] = shapeBits(q, i);
    for (std::size_t a = 0; a < 3; ++a) {
      EXPECT_LE(q.scale[a][i] >> scaleBits(q.lattice, q.precision[i]), Lattice::kMaxCoarseScale);
      EXPECT_EQ(q.position[a][i] >> position[a] >> q.lattice.cellBits, 0u);
      const int unused = Lattice::kMaxRotationBits - rotation[a];
      EXPECT_EQ(q.rotation[a][i] >> Lattice::kMaxRotationBits, 0);
      EXPECT_EQ(q.rotation[a][i] & ((1 << unused) - 1), 0);
    }
    EXPECT_LE(std::uint32_t(std::max(q.intensity[i], -1 - q.intensity[i])), Lattice::kMaxIntensity);
    EXPECT_TRUE(q.lattice.signedIntensity || q.intensity[i] >= 0);
  }
  (void)expectComesBack(before, q);
}

/// \return whether the bytes were read
bool expectReadOrRefused(std::span<const std::byte> bytes, const QuantisedEllipsoids& before,
                         const Lattice& lattice) {
  try {
    expectValid(readBack(bytes, before, lattice), before);
    return true;
  } catch (const BadInput&) {
    return false;
  }
}

TEST(ContinuedCoder, ReadsOrRefusesChangedBytesAndTruncations) {
  const QuantisedEllipsoids before = firstFrame(60, true);
  QuantisedEllipsoids now = frameAfter(before, mostOf(before, 6));
  const auto whole = bytesOf(before, now);
  test::Random random(11);
  int read = 0;
  for (int n = 0; n < 2000; ++n) {
    auto bytes = whole;
    for (int k = 0; k < 1 + n % 4; ++k)
      bytes[std::size_t(random(0.0, double(bytes.size())))] = std::byte(random(0.0, 256.0));
    read += expectReadOrRefused(bytes, before, now.lattice);
  }
  EXPECT_GT(read, 0);
  for (std::size_t size = 0; size < whole.size(); ++size)
    (void)expectReadOrRefused(std::span(whole).first(size), before, now.lattice);
}

TEST(ContinuedCoder, ReadsOrRefusesAnyBytes) {
  const QuantisedEllipsoids before = firstFrame(60);
  test::Random random(12);
  for (int n = 0; n < 500; ++n) {
    std::vector<std::byte> bytes(1 + std::size_t(n));
    for (std::byte& byte : bytes) byte = std::byte(random(0.0, 256.0));
    (void)expectReadOrRefused(bytes, before, before.lattice);
  }
}

/// Positions of up to 22 bits in a single cell, which is the finest lattice, at the end of the
/// integers, and cells as far away as can be.
TEST(ContinuedCoder, ReadsOrRefusesBytesOfExtremeLattices) {
  QuantisedEllipsoids before = firstFrame(40);
  before.lattice.cellBits = 0;
  before.lattice.positionBase = 1 << 20;
  before.lattice.lowestCell = {INT32_MIN, INT32_MAX, 0};
  for (auto& plane : before.position)
    for (auto& code : plane) code &= (1u << Lattice::kMaxPositionBits) - 1;
  Lattice far = before.lattice;
  far.lowestCell = far.lowestCell + Coord{1 << 21, -(1 << 21), 1 << 21};
  QuantisedEllipsoids same = before;
  same.continues = allOf(before);
  (void)expectComesBack(before, same);
  test::Random random(13);
  for (int n = 0; n < 300; ++n) {
    std::vector<std::byte> bytes(200);
    for (std::byte& byte : bytes) byte = std::byte(random(0.0, 256.0));
    (void)expectReadOrRefused(bytes, before, before.lattice);
    (void)expectReadOrRefused(bytes, before, far);
  }
}

}  // namespace
}  // namespace esvr::codec
