// Plan: everything that is written is read again bit by bit, in the order of ellipsoids that the file has: grids, vectors,
// carried grids and files on disk, which are written completely or not at all. What cannot be written or read is refused by
// name. The files in golden/ are read, and this library still writes them: a change of the format needs a new version.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "fit/volumes.h"
#include "format/sample_files.h"
#include "support/files.h"
#include "support/messages.h"

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

StoredGrid gridOfTones() {
  StoredGrid grid = fogGrid(7);
  grid.tone.scale = 0.25f;
  grid.withinRange = true;
  return grid;
}

TEST(RoundTrip, AFarBackgroundAndAToneCurveRaiseTheVersionAndComeBack) {
  const auto minorVersionOf = [](const std::vector<std::byte>& bytes) { return int(bytes[10]); };
  StoredGrid far = fogGrid(7);
  EXPECT_LT(minorVersionOf(encodeEsvr(fileOf(far))), 5);
  far.farBackground = true;
  far.topology = TopologyKind::kThreshold;
  far.field.background = 300.0f;
  for (const StoredGrid& grid : {far, gridOfTones()})
    for (const auto layout : {FileLayout::kPlain, FileLayout::kCompact}) {
      EsvrFile file = fileOf(grid);
      file.layout = layout;
      const auto bytes = encodeEsvr(file);
      EXPECT_EQ(minorVersionOf(bytes), 5);
      const EsvrFile back = decodeEsvr(bytes, "memory");
      EXPECT_EQ(difference(back, file), "");
      EXPECT_EQ(back.grids.front().farBackground, grid.farBackground);
      EXPECT_EQ(back.grids.front().tone, grid.tone);
    }
}

TEST(RoundTrip, CarriedGridsVectorsAndReferencesRaiseTheVersion) {
  const auto minorVersionOf = [](const EsvrFile& file) { return int(encodeEsvr(file)[10]); };
  EsvrFile file{{}, {fogGrid(3)}};
  EXPECT_EQ(minorVersionOf(file), 0);
  file.carried = {carriedGrid(0, "bytes")};
  EXPECT_EQ(minorVersionOf(file), 1);
  for (const GoldenFile& golden : goldenFiles()) {
    if (golden.name == "vector_grid") {
      EXPECT_EQ(minorVersionOf(golden.content), 2);
    }
    if (golden.name == "related_voxels") {
      EXPECT_EQ(minorVersionOf(golden.content), 4);
    }
  }
}

TEST(RoundTrip, AToneCurveThatHasNoMeaningIsRefused) {
  const auto refuses = [](const auto& spoil) {
    StoredGrid grid = gridOfTones();
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

// ---- Files on disk

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class ContainerFile : public testing::Test {
 protected:
  [[nodiscard]] fs::path path() const { return folder_ / "f.esvr"; }
  void put(const std::vector<std::byte>& bytes) const { writeBytes(path(), bytes); }
  void put(const std::string& text) const { put(bytesOf(text)); }

  TemporaryFolder folder_;
};

TEST_F(ContainerFile, ComesBackAndHasTheSizeThatWasSaid) {
  const EsvrFile file = everything(100);
  const std::uint64_t written = writeEsvr(path(), file);
  EXPECT_EQ(written, fs::file_size(path()));
  EXPECT_EQ(difference(readEsvr(path()), file), "");
}

TEST_F(ContainerFile, AnExistingOneIsReplacedOnlyWhenAsked) {
  put("precious");
  const EsvrFile file = everything(1);
  EXPECT_THAT([&] { writeEsvr(path(), file); }, ThrowsSaying<RuntimeFailure>("exists already"));
  EXPECT_EQ(fs::file_size(path()), 8u);
  writeEsvr(path(), file, {.overwrite = true});
  EXPECT_EQ(difference(readEsvr(path()), file), "");
}

TEST_F(ContainerFile, AFullDiskLeavesNothing) {
  {
    const FileSizeLimit limit(1000);
    EXPECT_THAT([&] { writeEsvr(path(), everything(100)); },
                ThrowsSaying<RuntimeFailure>("f.esvr"));
  }
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(ContainerFile, WhatCannotBeStoredIsNamedAndLeavesNothing) {
  StoredGrid grid = fogGrid(4);
  grid.field.chunks[0].ellipsoids.intensity[2] = std::numeric_limits<float>::infinity();
  EXPECT_THAT([&] { writeEsvr(path(), fileOf(grid)); },
              ThrowsSaying<RuntimeFailure>("'density'", "intensity of ellipsoid 2"));
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(ContainerFile, OtherThingsAreRefusedByName) {
  EXPECT_THAT([&] { (void)readEsvr(path()); }, ThrowsSaying<BadInput>("f.esvr: No such file"));
  EXPECT_THAT([&] { (void)readEsvr(folder_.path()); },
              ThrowsSaying<BadInput>("not a regular file"));
  EXPECT_THAT([&] { (void)readEsvr("/dev/zero"); }, ThrowsSaying<BadInput>("not a regular file"));
  put("");
  EXPECT_THAT([&] { (void)readEsvr(path()); }, ThrowsSaying<BadInput>("not an .esvr file"));
  put("a text of more than a few words, but still a text");
  EXPECT_THAT([&] { (void)inspectEsvr(path()); }, ThrowsSaying<BadInput>("not an .esvr file"));
}

TEST_F(ContainerFile, APipeIsRefusedWithoutWaiting) {
  ASSERT_EQ(::mkfifo(path().c_str(), 0600), 0);
  EXPECT_THROW((void)readEsvr(path()), BadInput);
}

TEST_F(ContainerFile, InspectionListsTheSections) {
  writeEsvr(path(), fileOf(chunkedGrid(50)));
  const EsvrSummary summary = inspectEsvr(path());
  EXPECT_EQ(summary.versionMajor, kFormatVersion);
  EXPECT_EQ(summary.fileBytes, fs::file_size(path()));
  std::vector<std::string> kinds;
  for (const auto& s : summary.sections) kinds.push_back(s.kind);
  // The first chunk has no rotations, and the second one has no ellipsoids.
  EXPECT_THAT(kinds, ElementsAre("grid", "chunks", "centers", "scales", "intensities", "centers",
                                 "scales", "rotations", "intensities", "kappas"));
  EXPECT_EQ(summary.sections[2].rawBytes, 50u * 3 * sizeof(float));
}

constexpr auto kUnknownKindOfSection = format::SectionKind(0x1234);

TEST_F(ContainerFile, InspectionNamesWhatItDoesNotKnow) {
  CraftedFile crafted(encodeEsvr({}));
  crafted.add({kUnknownKindOfSection}, 0, bytesOf("?"));
  put(crafted.assemble());
  const EsvrSummary summary = inspectEsvr(path());
  ASSERT_EQ(summary.sections.size(), 1u);
  EXPECT_EQ(summary.sections[0].kind, "unknown 0x1234");
  EXPECT_EQ(summary.sections[0].grid, 0xffffffffu);
}

TEST_F(ContainerFile, InspectionDoesNotReadTheSections) {
  CraftedFile crafted(encodeEsvr(everything(10)));
  auto bytes = crafted.assemble();
  bytes.back() ^= std::byte{1};
  put(bytes);
  EXPECT_EQ(inspectEsvr(path()).fileBytes, bytes.size());
  EXPECT_THROW((void)readEsvr(path()), BadInput);
}

constexpr std::size_t kUniformMapBytes = 15 * sizeof(double);  // five vectors

StoredGrid withMap(StoredGrid grid, std::size_t bytes) {
  grid.descriptor.transform.mapType = "UniformScaleMap";
  grid.descriptor.transform.map.assign(bytes, std::byte{});
  return grid;
}

TEST_F(ContainerFile, CheckHasNothingToSayOfAGoodFile) {
  writeEsvr(path(), fileOf(withMap(fogGrid(100), kUniformMapBytes)));
  EXPECT_THAT(checkEsvr(path()), IsEmpty());
}

TEST_F(ContainerFile, CheckRefusesATransformThatIsTooShortOrTooLong) {
  for (const std::size_t bytes : {std::size_t{0}, kUniformMapBytes - 1, kUniformMapBytes + 1}) {
    const fs::path file = path();
    fs::remove(file);
    writeEsvr(file, fileOf(withMap(fogGrid(100), bytes)));
    EXPECT_NO_THROW((void)readEsvr(file)) << "voxels need no transform";
    EXPECT_THAT([&] { (void)checkEsvr(file); },
                ThrowsSaying<BadInput>("not a map of type UniformScaleMap"));
  }
}

TEST_F(ContainerFile, CheckNotesWhatAReaderPassesOver) {
  StoredGrid odd = withMap(emptyGrid(), kUniformMapBytes);
  odd.field.background = 2.0f;
  CraftedFile crafted(encodeEsvr(fileOf(odd)));
  crafted.versionMinor = 7;
  crafted.add({kUnknownKindOfSection, 0}, 0, bytesOf("?"));
  put(crafted.assemble());
  EXPECT_THAT(checkEsvr(path()),
              ElementsAre(HasSubstr("format 1.7"), HasSubstr("unknown 0x1234 of grid 0, 1 bytes"),
                          HasSubstr("no ellipsoids"), HasSubstr("another in its field")));
}

TEST_F(ContainerFile, CheckThrowsForADamagedFile) {
  auto bytes = encodeEsvr(fileOf(fogGrid(100)));
  bytes.back() ^= std::byte{1};
  put(bytes);
  EXPECT_THAT([&] { (void)checkEsvr(path()); }, ThrowsSaying<BadInput>("checksum"));
}

// ---- Carried grids

using format::SectionKind;
using testing::AllOf;

/// Two converted grids and two carried ones, one of which is first and one last.
EsvrFile fileOfFour() {
  return {{},
          {fogGrid(3), emptyGrid()},
          {carriedGrid(0, "first"), carriedGrid(3, std::string(5000, 'l'))}};
}

TEST(CarriedGrids, ComeBackBitForBit) { EXPECT_EQ(lossOf(fileOfFour()), ""); }

TEST(CarriedGrids, StandAtTheirPlacesBetweenTheOthers) {
  EsvrFile file = fileOfFour();
  const GridOfFile first{true, 0}, last{true, 1}, fog{false, 0}, empty{false, 1};
  EXPECT_THAT(gridsInOrder(file), ElementsAre(first, fog, empty, last));
  EXPECT_THAT(namesInOrder(file), ElementsAre("velocity", "density", "", "velocity"));
  file.carried[1].place = 2;
  EXPECT_THAT(gridsInOrder(file), ElementsAre(first, fog, last, empty));
  file.grids.clear();
  file.carried[1].place = 1;
  EXPECT_THAT(gridsInOrder(file), ElementsAre(first, last));
}

TEST(CarriedGrids, WithImpossiblePlacesAreNotWritten) {
  for (const std::uint32_t place : {0u, 4u, 0xffffffffu}) {
    EsvrFile file = fileOfFour();
    file.carried[1].place = place;
    EXPECT_THAT(refusalToWrite(file), Says("velocity", std::to_string(place)));
  }
}

TEST(CarriedGrids, WithImpossiblePlacesAreNotRead) {
  CraftedFile crafted(encodeEsvr(fileOfFour()));
  // The place is before the last number of the record.
  const std::size_t at = crafted.content(SectionKind::kCarried).size() - 12;
  crafted.poke(SectionKind::kCarried, at, std::uint32_t{77});
  EXPECT_THAT(refusalToRead(crafted.assemble()), HasSubstr("place 77"));
}

TEST(CarriedGrids, NeedTheirBytes) {
  CraftedFile crafted(encodeEsvr(fileOfFour()));
  crafted.erase(SectionKind::kCarriedBytes);
  EXPECT_THAT(refusalToRead(crafted.assemble()), HasSubstr("there is no carried bytes of grid 2"));
}

TEST(CarriedGrids, BytesWithoutAGridBelongToNothing) {
  CraftedFile crafted(encodeEsvr(fileOfFour()));
  crafted.add({SectionKind::kCarriedBytes, 9}, 0, bytesOf("stray"));
  EXPECT_THAT(refusalToRead(crafted.assemble()), HasSubstr("belongs to nothing"));
}

TEST(CarriedGrids, WithTheSameBytesShareThem) {
  EsvrFile file = fileOfFour();
  const std::uint64_t two = encodeEsvr(file).size();
  std::string text;
  for (int i = 0; i < 5000; ++i) text += char(i * i % 251);  // hardly compressible
  file.carried = {carriedGrid(0, text), carriedGrid(3, text)};
  EXPECT_LT(encodeEsvr(file).size(), two + text.size() + 100) << "5000 bytes are stored once";
  EXPECT_EQ(lossOf(file), "");
}

TEST_F(ContainerFile, OfCarriedGridsCanBeReadWithoutTheBytes) {
  const EsvrFile file = fileOfFour();
  writeEsvr(path(), file);
  EsvrFile read = readEsvr(path(), {.carriedBytes = false});
  EXPECT_EQ(namesInOrder(read), namesInOrder(file));
  EXPECT_TRUE(read.carried[0].bytes.empty());
  EXPECT_EQ(readEsvrPart(path(), {.layers = 1}).file.carried, read.carried);
  EXPECT_EQ(readEsvrPart(path(), {.carriedBytes = true}).file.carried, file.carried);
  EXPECT_THAT(refusalToWrite(read), HasSubstr("its bytes were not read"));
}

TEST_F(ContainerFile, OfCarriedGridsIsCheckedEvenIfTheirBytesAreNotKept) {
  auto bytes = encodeEsvr(fileOfFour());
  bytes.back() ^= std::byte{1};
  writeBytes(path(), bytes);
  EXPECT_THROW((void)readEsvr(path(), {.carriedBytes = false}), BadInput);
  EXPECT_THROW((void)checkEsvr(path()), BadInput);
}

TEST_F(ContainerFile, OfCarriedGridsIsNotedByACheck) {
  writeEsvr(path(), fileOfFour());
  EXPECT_THAT(checkEsvr(path()), testing::Contains(HasSubstr("is carried unchanged")));
}

TEST_F(ContainerFile, OfCarriedGridsLargerThanTheMemoryIsRefusedOrReadIntoAFile) {
  EsvrFile file{{}, {}, {carriedGrid(0, std::string(1'000'000, 'x'))}};
  writeEsvr(path(), file);
  EXPECT_THROW((void)readEsvr(path(), {.maxBytes = 100'000}), MemoryExceeded);
  const VoxelMemory files({.folder = folder_ / ".", .maxHeapBytes = 1000});
  const EsvrFile read = readEsvr(path(), {.maxBytes = 100'000, .memory = files});
  EXPECT_EQ(read.carried, file.carried);
  writeEsvr(folder_ / "again.esvr", read);
  EXPECT_EQ(readEsvr(folder_ / "again.esvr").carried, file.carried);
}

TEST_F(ContainerFile, OfVoxelsThatAreTooManyTogetherIsRefusedOrReadIntoFiles) {
  constexpr int kGrids = 6;
  EsvrFile file;
  for (int g = 0; g < kGrids; ++g) {
    const SparseVolume volume =
        fullBricks({{0, 0, 0}, {0, 0, 8}}, 0.0f, [&](Coord at) { return float(g + at.x); });
    file.grids.push_back(makeStoredVoxels({}, volume, exactLayer(volume)));
    file.grids.back().descriptor.name = "grid" + std::to_string(g);
  }
  writeEsvr(path(), file);
  // Codes and values of two bricks take 8 KB, so that no grid is too large by itself.
  constexpr std::uint64_t kTooLittle = 60'000, kForNone = 2'000;
  EXPECT_THROW((void)readEsvr(path(), {.maxBytes = kTooLittle}), MemoryExceeded);
  const VoxelMemory files({.folder = folder_ / ".", .maxHeapBytes = kTooLittle / 4});
  const EsvrFile read = readEsvr(path(), {.maxBytes = kTooLittle, .memory = files});
  EXPECT_EQ(difference(read, file), "");
  const auto isInFile = [](const StoredGrid& grid) {
    const auto& codes = grid.voxels->codes;
    return codes.get_allocator().memory().isInFile(codes.size() * sizeof(codes[0]));
  };
  EXPECT_FALSE(isInFile(read.grids.front()));
  EXPECT_TRUE(isInFile(read.grids.back()));
  EXPECT_THROW((void)readEsvr(path(), {.maxBytes = kForNone, .memory = files}), MemoryExceeded);
}

TEST_F(ContainerFile, SlowOfSeveralBloscBuffersComesBack) {
  std::string text(std::size_t{130'000'001}, 'x');  // three buffers of at most 2^26 bytes
  for (std::size_t i = 0; i < text.size(); i += 1000) text[i] = char(i / 1000);
  EsvrFile file{{}, {}, {carriedGrid(0, text)}};
  const std::uint64_t bytes = writeEsvr(path(), file);
  EXPECT_EQ(bytes, std::filesystem::file_size(path()));
  EXPECT_LT(bytes, text.size() / 10);
  EsvrFile read = readEsvr(path());
  ASSERT_EQ(read.carried.front().bytes.size(), text.size());
  // Elements that are compared one by one take seconds without optimisation.
  EXPECT_EQ(std::memcmp(read.carried.front().bytes.data(), text.data(), text.size()), 0);
  read.carried.front().bytes = file.carried.front().bytes = {};
  EXPECT_EQ(read.carried, file.carried);
}

// ---- Vectors

/// A grid of numbers, and vectors with three grids as components.
EsvrFile fileOfVectors() {
  EsvrFile file{{}, {fogGrid(2)}};
  for (std::size_t c = 0; c < kComponents; ++c) {
    file.grids.push_back(fogGrid(c + 1));
    file.grids.back().descriptor.name = componentName("v", c);
    file.grids.back().descriptor.background = double(c);
  }
  file.vectors = {{"v", 1}};
  return file;
}

TEST(StoredVectors, ComeBackWithTheirComponents) {
  const EsvrFile file = fileOfVectors();
  const EsvrFile read = decodeEsvr(encodeEsvr(file), "f.esvr");
  EXPECT_EQ(difference(read, file), "");
  const VectorGrid vectors = decodeVector("v", componentsOf(read, read.vectors.front()));
  EXPECT_EQ(vectors.descriptor.name, "v");
  EXPECT_THAT(vectors.background, ElementsAre(0.0, 1.0, 2.0));
  for (std::size_t c = 0; c < kComponents; ++c)
    EXPECT_EQ(vectors.components[c].values, decodeGrid(file.grids[1 + c]).values);
}

TEST(StoredVectors, StandForTheirComponentsInTheOrderOfTheFile) {
  EsvrFile file = fileOfVectors();
  file.carried = {carriedGrid(1, "a"), carriedGrid(5, "b")};
  const GridOfFile fog{false, 0}, v{false, 0, true}, a{true, 0}, b{true, 1};
  EXPECT_THAT(gridsInOrder(file), ElementsAre(fog, a, v, b));
  EXPECT_THAT(namesInOrder(file), ElementsAre("density", "velocity", "v", "velocity"));
  EXPECT_EQ(lossOf(file), "");
}

TEST(StoredVectors, AreNotDividedByACarriedGrid) {
  for (const std::uint32_t place : {2u, 3u}) {
    EsvrFile file = fileOfVectors();
    file.carried = {carriedGrid(place, "a")};
    EXPECT_THAT(refusalToWrite(file), HasSubstr("cannot have place"));
  }
}

TEST(StoredVectors, WithoutComponentsOfTheirOwnAreNotWritten) {
  const std::vector<std::vector<StoredVector>> impossible{
      {{"v", 2}}, {{"v", 4}}, {{"v", 1}, {"w", 1}}, {{"v", 0}, {"w", 2}}, {{"v", std::size_t(-1)}}};
  for (const auto& vectors : impossible) {
    EsvrFile file = fileOfVectors();
    file.vectors = vectors;
    EXPECT_THAT(refusalToWrite(file), HasSubstr("no three components of its own"));
  }
}

TEST(StoredVectors, WhoseComponentsDifferAreNotWritten) {
  EsvrFile file = fileOfVectors();
  file.grids[2].descriptor.valueType = ValueType::kDouble;
  EXPECT_THAT(refusalToWrite(file), Says("'v'", "differ"));
}

TEST(StoredVectors, WithoutComponentsOfTheirOwnAreNotRead) {
  CraftedFile crafted(encodeEsvr(fileOfVectors()));
  crafted.section(SectionKind::kVector).entry.id.grid = 2;
  EXPECT_THAT(refusalToRead(crafted.assemble()),
              Says("lie.esvr", "no three components of its own"));
}

TEST(StoredVectors, AddAtMostTheBytesThatTheyAreSaidToAdd) {
  EsvrFile file = fileOfVectors();
  const std::size_t with = encodeEsvr(file).size();
  const std::uint64_t said = bytesOfVectors(file.vectors);
  file.vectors.clear();
  const std::size_t without = encodeEsvr(file).size();
  EXPECT_LE(with, without + said);
  EXPECT_GT(with + kSectionRowBytes, without + said);
}

// ---- Golden files

const fs::path kFolder = ESVR_GOLDEN_DIR;

fs::path pathOf(const GoldenFile& golden) { return kFolder / (golden.name + ".esvr"); }

TEST(GoldenFiles, AllInTheFolderAreSmallAndKnown) {
  std::vector<std::string> found, known;
  for (const auto& entry : fs::directory_iterator(kFolder)) {
    found.push_back(entry.path().filename().string());
    EXPECT_LT(entry.file_size(), 4096u) << entry.path();
  }
  for (const auto& golden : goldenFiles()) known.push_back(golden.name + ".esvr");
  EXPECT_THAT(found, testing::UnorderedElementsAreArray(known));
}

TEST(GoldenFiles, DecodeToTheirContent) {
  for (const auto& golden : goldenFiles())
    EXPECT_EQ(difference(decodeEsvr(bytesIn(pathOf(golden)), golden.name), golden.content), "")
        << golden.name;
}

TEST(GoldenFiles, OneEllipsoidDecodesToTheNumbersTyped) {
  const auto file = readEsvr(kFolder / "one_ellipsoid.esvr");
  ASSERT_EQ(file.grids.size(), 1u);
  const auto& grid = file.grids[0];
  EXPECT_EQ(grid.descriptor.name, "density");
  EXPECT_EQ(grid.field.background, 1.0f);
  EXPECT_EQ(grid.field.kernel, Kernel{});
  ASSERT_EQ(grid.field.ellipsoidCount(), 1u);
  const auto& chunk = grid.field.chunks[0];
  EXPECT_EQ(chunk.origin, (Coord{10, -20, 30}));
  EXPECT_EQ(chunk.ellipsoids.center[2][0], 1000.0f);
  EXPECT_EQ(chunk.ellipsoids.logScale[1][0], -1.0f);
  EXPECT_EQ(chunk.ellipsoids.rotation[2][0], -0.6f);
  EXPECT_EQ(chunk.ellipsoids.intensity[0], 0.75f);
}

// ESVR_UPDATE_GOLDEN=1 stores them. Files of a release must not change within a version of the format.
TEST(GoldenFiles, AreWrittenByteForByte) {
  for (const auto& golden : goldenFiles()) {
    if (std::getenv("ESVR_UPDATE_GOLDEN")) writeBytes(pathOf(golden), bytesOf(golden));
    EXPECT_EQ(bytesOf(golden), bytesIn(pathOf(golden))) << golden.name;
  }
}

}  // namespace

}  // namespace esvr::test
