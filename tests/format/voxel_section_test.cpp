// Plan: layers of every form are decoded integer by integer. Wrong sections are detected before
// memory is allocated for them. The bytes of a smooth volume limit the errors of the predictor.
//
// A file with voxels that are not finite is damaged on purpose, with correct checksums. Each case changes one thing
// in the section or in the record, and the reader must name it. The counts in a record are there without the section.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <limits>
#include <map>
#include <string>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/esvr.h"
#include "esvr/grid_coding.h"
#include "field/random_field.h"
#include "fit/volumes.h"
#include "format/non_finite_section.h"
#include "format/sample_files.h"
#include "format/voxel_sections.h"
#include "support/files.h"
#include "support/machine.h"
#include "support/messages.h"
#include "support/non_finite.h"

namespace esvr::test {
namespace {

using format::getVoxels;
using format::putVoxels;
using format::SectionKind;
using testing::HasSubstr;

VoxelLayer voxelsOf(std::span<const std::byte> content, const std::string& where) {
  MemoryBudget budget(kNoMemoryLimit);
  return getVoxels(content, where, budget);
}

std::vector<VoxelLayer> someLayers() {
  const SparseVolume tube = tubeVolume(), ball = levelSetVolume();
  SparseVolume halves = tube;
  for (float& v : halves.values) v = std::round(v * 64.0f) / 64.0f;
  return {exactLayer(tube), exactLayer(ball), exactLayer(halves),
          boundedLayer(tube, 0.01, Activity::kByValue), boundedLayer(ball, 0.1, Activity::kExact)};
}

TEST(VoxelSection, ComesBackIntegerByInteger) {
  for (const VoxelLayer& layer : someLayers()) EXPECT_EQ(voxelsOf(putVoxels(layer), "v"), layer);
}

TEST(VoxelSection, ThatIsKeptCountsWhileTheLayerIsTheSame) {
  for (const VoxelLayer& layer : someLayers()) {
    VoxelLayer kept = layer;
    EXPECT_EQ(format::keepCoded(kept), putVoxels(layer).size());
    EXPECT_EQ(putVoxels(kept), putVoxels(layer));
    const auto expectCodedAnew = [&](const char* what) {
      VoxelLayer changed = kept;
      changed.coded = {};
      EXPECT_EQ(putVoxels(kept), putVoxels(changed)) << what;
      EXPECT_NE(putVoxels(kept), putVoxels(layer)) << what;
    };
    int active = 0;
    while (!kept.active[0].test(active)) ++active;
    std::int32_t& code = kept.codes[std::size_t(active)];
    const std::int32_t before = code;
    code += before > 0 ? -1 : 1;
    expectCodedAnew("a code");
    code = before, kept.divisor *= 2.0;
    expectCodedAnew("the divisor");
    kept.divisor /= 2.0, kept.background = -kept.background - 1.0f;
    expectCodedAnew("the background");
  }
}

TEST(VoxelSection, WithAReferenceIsKeptWhileBothLayersAreTheSame) {
  const std::vector<VoxelLayer> layers = someLayers();
  VoxelLayer of = layers[3], kept = of;
  for (std::int32_t& code : of.codes) code /= 2;
  const VoxelReference reference{std::size_t{0}, 2.0f, 0.0f}, other{std::size_t{0}, 1.5f, 0.0f};
  format::keepRelated(kept, reference, &of);
  ASSERT_TRUE(kept.related.section);
  const auto expectAsNew = [&](const VoxelReference& with, const VoxelLayer* context,
                               const char* what) {
    VoxelLayer anew = kept;
    anew.related = {};
    EXPECT_EQ(format::putRelated(kept, with, context), format::putRelated(anew, with, context))
        << what;
  };
  EXPECT_EQ(*format::putRelated(kept, reference, &of), *kept.related.section);
  expectAsNew(reference, &of, "the same");
  expectAsNew(other, &of, "another gain");
  expectAsNew({}, nullptr, "no reference");
  of.codes[7] += 1;
  expectAsNew(reference, &of, "a code of the reference");
  of.codes[7] -= 1, kept.divisor *= 2.0;
  expectAsNew(reference, &of, "the divisor");
}

TEST(VoxelSection, OfNoBrickComesBack) {
  EXPECT_EQ(voxelsOf(putVoxels(VoxelLayer{}), "v"), VoxelLayer{});
}

TEST(VoxelSection, PredictsWhatIsSmooth) {
  const SparseVolume smooth = volumeOf({}, 8, -1.0f, [](Coord v) {
    return float(std::sin(v.x * 0.05) + std::sin(v.y * 0.04) * std::cos(v.z * 0.03));
  });
  const VoxelLayer layer = boundedLayer(smooth, 0.01, Activity::kExact);
  // Neighbours differ by at most two steps, and second differences are a tenth of a step.
  EXPECT_LT(double(putVoxels(layer).size()) * 8.0, 1.6 * double(smooth.values.size()));
}

std::size_t bytesOfVoxels(const SparseVolume& volume) {
  return putVoxels(exactLayer(volume)).size();
}

/// Noise can be predicted from its mirror image only.
TEST(VoxelSection, FindsMirrors) {
  Random random(9);
  std::map<std::array<int, 3>, float> noise;
  const auto at = [&](int x, int y, int z) {
    const auto [it, fresh] = noise.try_emplace({x, y, z}, 0.0f);
    if (fresh) it->second = float(random(0.0, 1.0));
    return it->second;
  };
  const SparseVolume plain = volumeOf({}, 4, -1.0f, [&](Coord v) { return at(v.x, v.y, v.z); });
  const SparseVolume mirrored = volumeOf({}, 4, -1.0f, [&](Coord v) {
    return at(std::min(v.x, 29 - v.x), std::min(v.y, 31 - v.y), v.z);
  });
  // A quarter of the voxels, two columns of which have no image, plus the cost of the decisions.
  EXPECT_LT(double(bytesOfVoxels(mirrored)), 0.35 * double(bytesOfVoxels(plain)));
  EXPECT_EQ(voxelsOf(putVoxels(exactLayer(mirrored)), "v"), exactLayer(mirrored));
}

/// Noise of two bricks that are repeated along y and z and mirrored along x is stored once.
TEST(VoxelSection, CopiesBricks) {
  Random random(12);
  std::array<float, 512> noise{};
  for (float& v : noise) v = float(random(0.0, 1.0));
  const auto value = [&](Coord v) {
    const Coord first{std::min(v.x, 31 - v.x) & 7, v.y & 7, v.z & 7};
    return noise[std::size_t(voxelOffset(first))] + (v.x > 7 && v.x < 24 ? 1.0f : 0.0f);
  };
  const SparseVolume volume = volumeOf({}, 4, -1.0f, value);
  // 1024 of the 32,768 voxels have a float in the palette and a code of 10 bits each.
  EXPECT_LT(double(bytesOfVoxels(volume)) * 8.0, 1024 * (32.0 + 12.0));
  EXPECT_EQ(voxelsOf(putVoxels(exactLayer(volume)), "v"), exactLayer(volume));
  const VoxelLayer bounded = boundedLayer(volume, 0.01, Activity::kExact);
  EXPECT_LT(double(putVoxels(bounded).size()) * 8.0, 1024 * 9.0);
  EXPECT_EQ(voxelsOf(putVoxels(bounded), "v"), bounded);
}

/// A brick without active voxels at the border of the grid equals the vacant voxels before it.
TEST(VoxelSection, CopiesVacantPlaces) {
  VoxelLayer layer = boundedLayer(tubeVolume(), 0.01, Activity::kExact);
  for (const std::size_t b : {std::size_t{0}, layer.bricks.size() - 1}) {
    layer.active[b] = {};
    layer.vacant[b].setAll();
    std::fill_n(layer.codes.begin() + std::ptrdiff_t(b * kBrickVoxels), kBrickVoxels, 0);
  }
  EXPECT_EQ(voxelsOf(putVoxels(layer), "v"), layer);
}

/// Most floats have one common value. The values between them must not spoil the predictions.
TEST(VoxelSection, KnowsCommonValues) {
  Random random(10);
  const SparseVolume volume = volumeOf(
      {}, 4, 0.0f, [&](Coord v) { return v.x < 16 ? 0.5f : float(0.6 + 0.4 * random(0.0, 1.0)); });
  const VoxelLayer layer = exactLayer(volume);
  ASSERT_EQ(layer.form, VoxelForm::kFloat);
  // Half of the voxels have 23 bits of noise; the others take almost no bits.
  EXPECT_LT(double(putVoxels(layer).size()) * 8.0, 0.5 * 25.0 * double(volume.values.size()));
  EXPECT_EQ(voxelsOf(putVoxels(layer), "v"), layer);
}

/// Differences of all sizes, and those that exceed 32 bits.
TEST(VoxelSection, HoldsAnyFloats) {
  Random random(13);
  const auto value = [&](Coord) {
    const double exponent = random(-149.0, 128.0);
    return float(std::ldexp(random(0.0, 1.0) < 0.5 ? -1.0 : 1.0, int(exponent)));
  };
  const VoxelLayer layer = exactLayer(volumeOf({}, 4, 0.0f, value));
  EXPECT_EQ(voxelsOf(putVoxels(layer), "v"), layer);
  VoxelLayer codes;
  codes.form = VoxelForm::kQuantised;
  codes.bricks = {{0, 0, 0}};
  codes.active.resize(1);
  codes.vacant.resize(1);
  codes.active[0].setAll();
  for (int v = 0; v < kBrickVoxels; ++v)
    codes.codes.push_back(v % 3 == 0   ? std::numeric_limits<std::int32_t>::min()
                          : v % 3 == 1 ? std::numeric_limits<std::int32_t>::max()
                                       : v);
  EXPECT_EQ(voxelsOf(putVoxels(codes), "v"), codes);
}

/// More than 2048 bricks are several blocks, each of which has several parts. Some voxels are neither active nor vacant.
TEST(VoxelSection, HoldsBlocksAndParts) {
  const SparseVolume volume = volumeOf({}, 14, -1.0f, [](Coord v) {
    const float wave = float(std::sin(v.x * 0.3) * std::sin(v.y * 0.2) + std::cos(v.z * 0.1));
    return wave > 0.0f ? wave : -1.0f;
  });
  VoxelLayer layer = boundedLayer(volume, 0.01, Activity::kExact);
  for (std::size_t b = 0; b < layer.bricks.size(); b += 3)
    for (int v = int(b % 7); v < kBrickVoxels; v += 5)
      if (layer.active[b].test(v))
        layer.active[b].words[std::size_t(v / 64)] ^= std::uint64_t{1} << (v % 64);
  ASSERT_GT(layer.bricks.size(), 2048u);
  EXPECT_EQ(voxelsOf(putVoxels(layer), "v"), layer);
}

EsvrFile voxelFile() {
  const SparseVolume tube = tubeVolume({-16, 8, 1 << 20});
  return fileOf(makeStoredVoxels({}, tube, exactLayer(tube)));
}

TEST(VoxelFile, GivesBackItsVoxels) {
  const EsvrFile file = voxelFile();
  const auto bytes = encodeEsvr(file);
  const EsvrFile back = decodeEsvr(bytes, "memory");
  EXPECT_EQ(difference(back, file), "");
  EXPECT_EQ(encodeEsvr(back), bytes);
  EXPECT_EQ(volumeDifference(decodeGrid(back.grids[0]), tubeVolume({-16, 8, 1 << 20})), "");
}

TEST(VoxelFile, TakesNoThreshold) {
  EXPECT_THROW((void)decodeGrid(voxelFile().grids[0], {.threshold = 0.1f}), UsageError);
}

TEST(Residual, IsRefusedWhereItIsInvalid) {
  const SparseVolume tube = tubeVolume();
  StoredGrid grid = emptyGrid();
  grid.residual = exactLayer(tube);  // its form is not kQuantised
  EXPECT_THROW((void)encodeEsvr({{}, {grid}}), RuntimeFailure);
  grid.residual = boundedLayer(tube, 0.1, Activity::kExact);  // not all voxels active
  EXPECT_THROW((void)encodeEsvr({{}, {grid}}), RuntimeFailure);
  for (BrickMask& mask : grid.residual->active) mask.setAll();
  for (BrickMask& mask : grid.residual->vacant) mask = {};
  EXPECT_NO_THROW((void)encodeEsvr({{}, {grid}}));
  grid.voxels = exactLayer(tube);
  EXPECT_THROW((void)encodeEsvr({{}, {grid}}), RuntimeFailure);

  CraftedFile lie(encodeEsvr(voxelFile()));
  lie.add({SectionKind::kResidual, 0}, format::kRequired, putVoxels(exactLayer(tube)));
  EXPECT_THAT(refusalToRead(lie.assemble()), HasSubstr("residual"));
}

/// Offsets in the section (docs/format.md, "Voxels").
namespace voxels_at {
constexpr std::size_t kForm = 0, kDivisor = 1, kOrigin = 9, kBackground = 21, kPalette = 25;
}  // namespace voxels_at

template <class T>
void expectVoxelLie(std::size_t offset, T value, const char* answer) {
  CraftedFile file(encodeEsvr(voxelFile()));
  file.poke(SectionKind::kVoxels, offset, value);
  EXPECT_THAT(refusalToRead(file.assemble()), HasSubstr(answer));
}

TEST(VoxelLies, AreFoundOut) {
  expectVoxelLie(voxels_at::kForm, std::uint8_t{4}, "unknown form of voxels");
  expectVoxelLie(voxels_at::kDivisor, 0.0, "divisor");
  expectVoxelLie(voxels_at::kOrigin, std::int32_t{1}, "not a brick's corner");
  expectVoxelLie(voxels_at::kOrigin, std::int32_t{0x7ffffff8}, "outside the index space");
  expectVoxelLie(voxels_at::kBackground, HUGE_VALF, "background");
  expectVoxelLie(voxels_at::kPalette, 0xffffffffu, "palette");
}

TEST(VoxelLies, AKilobyteCannotAskForAGigabyte) {
  auto content = putVoxels(exactLayer(levelSetVolume()));
  content.resize(1024);
  const auto countAt = voxels_at::kPalette + 4;
  for (std::uint64_t count = std::uint64_t{1} << 62; count > 0; count /= 2) {
    const auto bytes = std::as_bytes(std::span(&count, 1));
    std::copy(bytes.begin(), bytes.end(), content.begin() + std::ptrdiff_t(countAt));
    const AllocationMeter meter;
    try {
      (void)voxelsOf(content, "lie");
    } catch (const BadInput&) {
    }
    EXPECT_LT(meter.bytes(), std::size_t{64} << 20) << count;
  }
}

TEST(VoxelLies, AnyBytesAreReadOrRefused) {
  const auto whole = putVoxels(boundedLayer(tubeVolume(), 0.1, Activity::kExact));
  std::uint32_t state = 5;
  for (int n = 0; n < trials(2000); ++n) {
    auto bytes = whole;
    for (int k = 0; k < 3; ++k) {
      state = state * 1664525u + 1013904223u;
      bytes[(state >> 8) % bytes.size()] = std::byte(state >> 24);
    }
    try {
      const VoxelLayer once = voxelsOf(bytes, "any");
      EXPECT_EQ(voxelsOf(putVoxels(once), "again"), once);
    } catch (const BadInput&) {
    }
  }
}

// ---- Voxels that are not finite

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
