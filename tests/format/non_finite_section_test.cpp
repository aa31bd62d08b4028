// Plan: a file with voxels that are not finite is damaged on purpose, with correct checksums. Each case changes one thing
// in the section or in the record, and the reader must name it. The counts in a record are there without the section.

#include "format/non_finite_section.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "../fit/volumes.h"
#include "esvr/error.h"
#include "esvr/esvr.h"
#include "esvr/grid_coding.h"
#include "format/crafted_file.h"
#include "format/sample_files.h"
#include "format/voxel_section.h"
#include "support/messages.h"
#include "support/non_finite.h"
#include "support/temporary_folder.h"

namespace esvr::test {
namespace {

using format::SectionKind;
using testing::HasSubstr;

/// A cube of ones with NaN at (1, 2, 3) and an infinity at (9, 9, 9).
SparseVolume cube() {
  return volumeOf({}, 2, 0.0f, [](Coord v) {
    if (v == Coord{1, 2, 3}) return kNan;
    return v == Coord{9, 9, 9} ? kInf : 1.0f;
  });
}

StoredGrid storedCube() {
  SparseVolume ones = cube();
  StoredGrid grid;
  grid.nonFiniteVoxels = format::nonFiniteLayer(ones);
  for (float& value : ones.values) value = 1.0f;
  StoredGrid made = makeStoredVoxels({}, ones, exactLayer(ones));
  made.nonFinite = format::countsOf(*grid.nonFiniteVoxels);
  made.nonFiniteVoxels = std::move(grid.nonFiniteVoxels);
  return made;
}

TEST(NonFiniteSection, ComesBackBitForBit) {
  const StoredGrid grid = storedCube();
  const auto bytes = encodeEsvr(fileOf(grid));
  const EsvrFile read = decodeEsvr(bytes, "f");
  EXPECT_EQ(read.grids.front().nonFiniteVoxels, grid.nonFiniteVoxels);
  EXPECT_EQ(read.grids.front().nonFinite, grid.nonFinite);
  EXPECT_EQ(encodeEsvr(read), bytes);
  EXPECT_EQ(valueAt(decodeGrid(read.grids.front()), {9, 9, 9}), kInf);
}

TEST(NonFiniteSection, IsGivenByTheCInterface) {
  const auto bytes = encodeEsvr(fileOf(storedCube()));
  esvr_file* file = nullptr;
  ASSERT_EQ(esvr_open_memory(bytes.data(), bytes.size(), "f", 0, &file), ESVR_OK);
  esvr_grid grid{};
  grid.size = sizeof grid;
  EXPECT_EQ(esvr_get_grid(file, 0, &grid), ESVR_OK);
  EXPECT_EQ(grid.nonfinite, 2u);
  const std::int32_t box[] = {9, 9, 8, 9, 9, 9};
  float values[2] = {};
  std::uint8_t active[2] = {};
  EXPECT_EQ(esvr_decode_box(file, 0, box, 0, values, active), ESVR_OK);
  EXPECT_EQ(values[0], 1.0f);
  EXPECT_EQ(values[1], kInf);
  EXPECT_EQ(active[1], 1);
  const double place[] = {0.0, 0.0, 0.0};
  EXPECT_EQ(esvr_evaluate(file, 0, 1, place, values), ESVR_USAGE);
  esvr_close(file);
}

TEST(NonFiniteSection, IsAddedToTheBricksOfAVolumeThatLacksThem) {
  StoredGrid grid = storedCube();
  SparseVolume volume;
  format::restoreNonFinite(grid, {grid.activeBox}, format::NonFiniteAs::kStored, volume);
  checkInvariants(volume);
  EXPECT_EQ(activeVoxelCount(volume), 2u);
  EXPECT_EQ(valueAt(volume, {9, 9, 9}), kInf);
}

TEST(NonFiniteSection, IsCountedByARecordAlone) {
  const TemporaryFolder folder;
  writeEsvr(folder / "f.esvr", fileOf(storedCube()));
  const EsvrFile records =
      readEsvrPart(folder / "f.esvr", {.grids = std::vector<std::size_t>{}}).file;
  EXPECT_EQ(records.grids.front().nonFinite.nan, 1u);
  EXPECT_EQ(records.grids.front().nonFinite.plusInfinity, 1u);
  EXPECT_FALSE(records.grids.front().nonFiniteVoxels);
}

struct Damage {
  const char* name;
  std::function<void(VoxelLayer&)> change;
  const char* words;
};

class DamagedNonFinite : public testing::TestWithParam<Damage> {};

TEST_P(DamagedNonFinite, IsNamed) {
  const StoredGrid grid = storedCube();
  CraftedFile file(encodeEsvr(fileOf(grid)));
  VoxelLayer layer = *grid.nonFiniteVoxels;
  GetParam().change(layer);
  file.setContent(SectionKind::kNonFinite, format::putVoxels(layer));
  EXPECT_THAT(refusalToRead(file.assemble()),
              Says("non-finite voxels of grid 0", GetParam().words));
}

constexpr int kAt = 1 * 64 + 2 * 8 + 3;  // (1, 2, 3) in the first brick

INSTANTIATE_TEST_SUITE_P(
    All, DamagedNonFinite,
    testing::Values(
        Damage{"another_kind", [](VoxelLayer& l) { l.codes[kAt] = 2; }, "another number"},
        Damage{"finite", [](VoxelLayer& l) { l.codes[kAt] = 0; }, "wrong kind"},
        Damage{"one_less",
               [](VoxelLayer& l) {
                 l.active[0].reset(kAt), l.vacant[0].set(kAt), l.codes[kAt] = 0;
                 l.active[0].set(0), l.vacant[0].reset(0), l.codes[0] = 2;
               },
               "another number"},
        Damage{
            "empty_brick",
            [](VoxelLayer& l) { l.active[0].reset(kAt), l.vacant[0].set(kAt), l.codes[kAt] = 0; },
            "has no voxel"},
        Damage{"not_vacant", [](VoxelLayer& l) { l.vacant[0].reset(0); }, "neither vacant"},
        Damage{"outside",
               [](VoxelLayer& l) {
                 l.origin = {800, 0, 0};
               },
               "outside the bounding box"},
        Damage{"palette", [](VoxelLayer& l) { l.palette[2] = 7.0f; }, "no kinds"},
        Damage{"order", [](VoxelLayer& l) { std::swap(l.palette[1], l.palette[2]); }, "no kinds"},
        Damage{"background", [](VoxelLayer& l) { l.background = 1.0f; }, "no kinds"},
        Damage{"form", [](VoxelLayer& l) { l.form = VoxelForm::kQuantised, l.palette.clear(); },
               "no kinds"}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST(NonFiniteSection, ThatIsMissingOrTooMuchIsNamed) {
  CraftedFile file(encodeEsvr(fileOf(storedCube())));
  file.erase(SectionKind::kNonFinite);
  EXPECT_THROW((void)decodeEsvr(file.assemble(), "f"), BadInput);
  StoredGrid plain = storedCube();
  const auto section = format::putNonFinite(plain, nullptr);
  plain.nonFinite = {};
  plain.nonFiniteVoxels.reset();
  CraftedFile other(encodeEsvr(fileOf(plain)));
  other.add({SectionKind::kNonFinite, 0}, format::kRequired, section);
  EXPECT_THROW((void)decodeEsvr(other.assemble(), "f"), BadInput);
}

TEST(NonFiniteSection, ThatRefersToNoFrameBeforeIsNamed) {
  CraftedFile file(encodeEsvr(fileOf(storedCube())));
  file.setContent(SectionKind::kNonFinite, {});
  EXPECT_THAT(refusalToRead(file.assemble()), HasSubstr("no frame before"));
}

TEST(NonFiniteSection, OfAGridThatCountsOthersIsNotWritten) {
  StoredGrid grid = storedCube();
  grid.nonFinite.nan = 5;
  EXPECT_THROW((void)encodeEsvr(fileOf(grid)), RuntimeFailure);
  grid = storedCube();
  grid.nonFiniteVoxels.reset();
  EXPECT_THROW((void)encodeEsvr(fileOf(grid)), RuntimeFailure);
}

}  // namespace
}  // namespace esvr::test
