// Plan: every part that a grid lacks and can have is forced into a grid of float32 ellipsoids and
// into one of quantised ellipsoids. The forced grid has the part after it was written and read, its
// voxels are the same bit for bit, and it takes as many bytes as stated. A grid that has a part, or
// cannot have it, has no such figures.

#include "esvr/forced_part.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "esvr/convert.h"
#include "esvr/grid_coding.h"
#include "volumes.h"

namespace esvr {
namespace {

bool sameBits(const SparseVolume& a, const SparseVolume& b) {
  const auto bits = [](float x, float y) {
    return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
  };
  return a.origin == b.origin && a.bricks == b.bricks && a.active == b.active &&
         std::ranges::equal(a.values, b.values, bits);
}

StoredGrid readBack(const StoredGrid& grid) {
  return decodeEsvr(encodeEsvr({{}, {grid}}), "f.esvr").grids[0];
}

GridDescriptor descriptor() {
  GridDescriptor grid;
  grid.name = "density";
  return grid;
}

/// A few unturned ellipsoids of one kappa, as float32.
StoredGrid floatGrid() {
  Field field;
  Ellipsoids& e = field.chunks.emplace_back().ellipsoids;
  e.resize(12);
  for (std::size_t i = 0; i < e.size(); ++i) {
    for (std::size_t a = 0; a < 3; ++a) {
      e.center[a][i] = 8.0f + 3.0f * float((i + a) % 5);
      e.logScale[a][i] = 1.0f + 0.1f * float(a);
    }
    e.rotation[0][i] = 1.0f;
    e.intensity[i] = 0.5f + 0.1f * float(i);
  }
  SparseVolume source = revoxelise(field, {});
  return makeStoredGrid(descriptor(), source, field, {Activity::kByValue});
}

/// A short fit of smooth blobs, quantised.
StoredGrid quantisedGrid() {
  ConvertOptions options;
  options.goal = SizeGoal{2000};
  options.representation = Representation::kEllipsoids;
  options.fit.iterations = 60;
  options.fit.bothSigns = false;
  static const SparseVolume volume = test::smoothVolume();
  return convertVolume({descriptor(), volume}, options).grid;
}

/// Forces every part that a grid can have. \return the names of these parts
std::vector<std::string> forceAll(const StoredGrid& source) {
  // A reader gets the ellipsoids in the order of the file, in which they are always summed.
  const StoredGrid grid = readBack(source);
  const SparseVolume decoded = decodeGrid(grid);
  std::vector<std::string> forced;
  for (const auto& [part, name] : allParts()) {
    const PartState state = stateOf(grid, part);
    const auto bytes = bytesWithPart(grid, part, decoded);
    EXPECT_EQ(bytes.has_value(), !state.stored && state.why.empty()) << name;
    if (!bytes) continue;
    const StoredGrid made = readBack(forcedPart(grid, part, decoded));
    EXPECT_TRUE(stateOf(made, part).stored) << name;
    EXPECT_TRUE(sameBits(decodeGrid(made), decoded)) << name;
    EXPECT_EQ(bytes->with, bytesAdded(forcedPart(grid, part, decoded))) << name;
    EXPECT_EQ(bytes->without, bytesAdded(grid)) << name;
    // Signs that are all the same take less than a byte, which padding may hide.
    EXPECT_GE(bytes->with, bytes->without + (part == Part::kSigns ? 0 : 1)) << name;
    forced.emplace_back(name);
  }
  return forced;
}

TEST(ForcedPart, TakesBytesAndKeepsTheVoxelsOfFloatEllipsoids) {
  EXPECT_THAT(forceAll(floatGrid()), testing::ElementsAre("rotations", "kappa", "residual", "mask",
                                                          "thresholds of blocks", "chunk table"));
}

TEST(ForcedPart, TakesBytesAndKeepsTheVoxelsOfQuantisedEllipsoids) {
  EXPECT_THAT(forceAll(quantisedGrid()),
              testing::IsSupersetOf({"signs", "residual", "layers", "chunk table"}));
}

TEST(ForcedPart, IsNotForcedWhereTheGridHasIt) {
  StoredGrid grid = floatGrid();
  const SparseVolume decoded = decodeGrid(grid);
  grid = forcedPart(grid, Part::kMask, decoded);
  EXPECT_TRUE(stateOf(grid, Part::kMask).stored);
  EXPECT_FALSE(bytesWithPart(grid, Part::kMask, decoded));
}

TEST(ForcedPart, GivesTheReasonWhyAGridCannotHaveIt) {
  EXPECT_THAT(stateOf(floatGrid(), Part::kSigns).why, testing::HasSubstr("float32"));
  EXPECT_THAT(stateOf(floatGrid(), Part::kLayers).why, testing::HasSubstr("quantised"));
  EXPECT_THAT(stateOf(quantisedGrid(), Part::kKappas).why, testing::HasSubstr("one kappa"));
  StoredGrid empty;
  for (const auto& [part, name] : allParts())
    EXPECT_THAT(stateOf(empty, part).why, testing::HasSubstr("no ellipsoids")) << name;
}

}  // namespace
}  // namespace esvr
