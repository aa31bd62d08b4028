// Plan: everything that is written is read again bit by bit, in the file's order of ellipsoids.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "esvr/container.h"
#include "esvr/error.h"
#include "format/sample_files.h"

namespace esvr::test {
namespace {

EsvrFile roundTrip(const EsvrFile& file) { return decodeEsvr(encodeEsvr(file), "memory"); }

/// Swaps ellipsoids i and j.
void swapEllipsoids(Ellipsoids& e, std::size_t i, std::size_t j) {
  for (auto& v : e.center) std::swap(v[i], v[j]);
  for (auto& v : e.logScale) std::swap(v[i], v[j]);
  for (auto& v : e.rotation) std::swap(v[i], v[j]);
  std::swap(e.intensity[i], e.intensity[j]);
  if (!e.kappa.empty()) std::swap(e.kappa[i], e.kappa[j]);
}

TEST(RoundTrip, EveryPartComesBack) {
  for (const std::size_t n : {1u, 7u, 5000u}) EXPECT_EQ(lossOf(everything(n)), "") << n;
}

TEST(RoundTrip, AFileWithoutGrids) { EXPECT_EQ(lossOf({}), ""); }

TEST(RoundTrip, AGridWithoutEllipsoids) { EXPECT_EQ(lossOf(fileOf(emptyGrid())), ""); }

TEST(RoundTrip, AnyFiniteFloat) {
  using Limits = std::numeric_limits<float>;
  const float extremes[] = {0.0f,          -0.0f,          Limits::denorm_min(),
                            Limits::min(), -Limits::min(), -Limits::denorm_min(),
                            Limits::max(), -Limits::max(), std::nextafter(1.0f, 2.0f)};
  const std::size_t n = std::size(extremes);
  Ellipsoids e = sampleEllipsoids(n, 1, {.kappas = true});
  for (std::size_t i = 0; i < n; ++i) {
    for (auto& scale : e.logScale) scale[i] = std::clamp(extremes[i], -kMaxLogScale, kMaxLogScale);
    e.intensity[i] = e.kappa[i] = extremes[i];
    e.center[0][i] = extremes[(i + 3) % n];
  }
  StoredGrid grid = emptyGrid();
  grid.field.chunks = {{{}, e}};
  const EsvrFile once = roundTrip(fileOf(grid));
  EXPECT_EQ(lossOf(once), "");

  const auto sortedBits = [](std::vector<float> v) {
    std::sort(v.begin(), v.end(), [](float a, float b) {
      return std::bit_cast<std::uint32_t>(a) < std::bit_cast<std::uint32_t>(b);
    });
    std::vector<std::uint32_t> bits;
    for (const float f : v) bits.push_back(std::bit_cast<std::uint32_t>(f));
    return bits;
  };
  const auto& back = once.grids[0].field.chunks[0].ellipsoids;
  EXPECT_EQ(sortedBits(back.intensity), sortedBits(e.intensity));
  EXPECT_EQ(sortedBits(back.center[0]), sortedBits(e.center[0]));
  EXPECT_EQ(sortedBits(back.logScale[2]), sortedBits(e.logScale[2]));
}

TEST(RoundTrip, NegativeZeroInARotationIsNotTheIdentity) {
  StoredGrid grid = levelSetGrid(3);
  grid.field.chunks[0].ellipsoids.rotation[2][1] = -0.0f;
  EXPECT_EQ(lossOf(fileOf(grid)), "");
}

TEST(RoundTrip, StringsAreBytes) {
  StoredGrid grid = fogGrid(2);
  grid.descriptor.name = std::string(
      "nul \0 and Gr\xc3\xb6\xc3\x9f"
      "e",
      16);
  grid.descriptor.metadata.push_back({std::string("\0", 1), "", {}});
  EXPECT_EQ(lossOf(fileOf(grid)), "");
}

TEST(RoundTrip, HugeMetadata) {
  std::vector<std::byte> noise(1'000'000);
  std::uint32_t state = 1;
  for (auto& b : noise) b = std::byte((state = state * 1664525u + 1013904223u) >> 24);
  EsvrFile file = fileOf(fogGrid(2));
  file.metadata = {{"noise", "blob", noise},
                   {"zeros", "string", std::vector<std::byte>(5'000'000)}};
  EXPECT_EQ(lossOf(file), "");
}

TEST(RoundTrip, EqualEllipsoidsCompressToTheirBoundAndComeBack) {
  StoredGrid grid = emptyGrid();
  Ellipsoids e;
  e.resize(200'000);
  std::fill(e.rotation[0].begin(), e.rotation[0].end(), 1.0f);
  grid.field.chunks = {{{}, e}};
  EXPECT_EQ(lossOf(fileOf(grid)), "");
}

TEST(RoundTrip, APerfectFitHasAnInfinitePsnr) {
  StoredGrid grid = fogGrid(2);
  grid.curve[1].psnrBox = std::numeric_limits<double>::infinity();
  EXPECT_EQ(lossOf(fileOf(grid)), "");
}

TEST(RoundTrip, TheOrderInTheFileDoesNotDependOnTheOrderGiven) {
  StoredGrid grid = chunkedGrid(100);
  const auto bytes = encodeEsvr(fileOf(grid));
  for (std::size_t i = 0; i < 50; ++i) {
    swapEllipsoids(grid.field.chunks[0].ellipsoids, i, 99 - i);
    swapEllipsoids(grid.field.chunks[2].ellipsoids, i, (i * 7) % 100);
  }
  EXPECT_EQ(encodeEsvr(fileOf(grid)), bytes);
}

TEST(RoundTrip, EncodingAgainGivesTheSameBytes) {
  const auto bytes = encodeEsvr(everything(3000));
  EXPECT_EQ(encodeEsvr(everything(3000)), bytes);
  EXPECT_EQ(encodeEsvr(decodeEsvr(bytes, "memory")), bytes);
}

TEST(RoundTrip, AFarBackgroundRaisesTheVersionAndComesBack) {
  const auto minorVersionOf = [](const std::vector<std::byte>& bytes) { return int(bytes[10]); };
  StoredGrid grid = fogGrid(7);
  EXPECT_LT(minorVersionOf(encodeEsvr(fileOf(grid))), 5);
  grid.farBackground = true;
  grid.topology = TopologyKind::kThreshold;
  grid.field.background = 300.0f;
  EsvrFile file = fileOf(grid);
  for (const auto layout : {FileLayout::kPlain, FileLayout::kCompact}) {
    file.layout = layout;
    const auto bytes = encodeEsvr(file);
    EXPECT_EQ(minorVersionOf(bytes), 5);
    const EsvrFile back = decodeEsvr(bytes, "memory");
    EXPECT_EQ(difference(back, file), "");
    EXPECT_TRUE(back.grids.front().farBackground);
  }
}

TEST(RoundTrip, AToneCurveRaisesTheVersionAndComesBack) {
  StoredGrid grid = fogGrid(7);
  grid.tone.scale = 0.25f;
  grid.withinRange = true;
  EsvrFile file = fileOf(grid);
  for (const auto layout : {FileLayout::kPlain, FileLayout::kCompact}) {
    file.layout = layout;
    const auto bytes = encodeEsvr(file);
    EXPECT_EQ(int(bytes[10]), 5);
    const EsvrFile back = decodeEsvr(bytes, "memory");
    EXPECT_EQ(difference(back, file), "");
    EXPECT_EQ(back.grids.front().tone, grid.tone);
  }
}

TEST(RoundTrip, AToneCurveThatHasNoMeaningIsRefused) {
  const auto refuses = [](const auto& spoil) {
    StoredGrid grid = fogGrid(7);
    grid.tone.scale = 0.25f;
    grid.withinRange = true;
    spoil(grid);
    EXPECT_THROW((void)encodeEsvr(fileOf(grid)), RuntimeFailure);
  };
  refuses([](StoredGrid& grid) { grid.tone.scale = -1.0f; });
  refuses([](StoredGrid& grid) { grid.tone.scale = NAN; });
  refuses([](StoredGrid& grid) { grid.tone.scale = INFINITY; });
  refuses([](StoredGrid& grid) { grid.field.background = 1.0f; });
  refuses([](StoredGrid& grid) { grid.withinRange = false; });
  refuses([](StoredGrid& grid) { grid.farBackground = true; });
}

TEST(RoundTrip, AFarBackgroundOfBricksIsRefused) {
  StoredGrid grid = levelSetGrid(7);
  grid.farBackground = true;
  EXPECT_THROW((void)encodeEsvr(fileOf(grid)), RuntimeFailure);
}

}  // namespace
}  // namespace esvr::test
