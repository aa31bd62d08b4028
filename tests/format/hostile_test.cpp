// Plan: every case changes one thing in a good file and corrects the checksums, and the reader must name
// it. Small files that would need much memory are refused before it is allocated, with the number of
// bytes in the message; within the limit, the same content is read.
//
// Whatever happens to the bytes of a file by accident, it is refused or its content is that
// of the original. Checksums cover every byte that need not be zero, so damage is found unless
// 64-bit hashes collide.
//
// Each byte of a small sequence is damaged, and the file is cut at each byte. The check must
// find every damage, and a reader must lose no frame but the damaged one and those that refer to
// it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>
#include <string>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/sequence_file.h"
#include "fit/volumes.h"
#include "format/bytes.h"
#include "format/sample_files.h"
#include "format/section_reader.h"
#include "support/files.h"
#include "support/machine.h"
#include "support/messages.h"
#include "support/non_finite.h"

namespace esvr::test {
namespace {

using format::Codec;
using format::kNone;
using format::SectionKind;
using format::SectionTable;
using testing::HasSubstr;

constexpr std::uint32_t kUnknownKind = 0x1234;
constexpr std::uint64_t kMegabyte = 1 << 20;

/// Offsets in the record of a grid without name, map and metadata (docs/format.md, "Grid record").
namespace at {
constexpr std::size_t kNameLength = 0, kClass = 4, kValueType = 5, kBackground = 6, kAffine = 22,
                      kItems = 23, kTopology = 27, kWithinRange = 28, kThreshold = 29,
                      kValueMin = 65, kFieldBackground = 73, kKernel = 77, kKappa = 78,
                      kEpsilon = 82, kChunkCount = 86, kChunkBox = 102, kCount = 126;
}  // namespace at

/// A grid with one chunk of four ellipsoids with all attributes, bricks and a curve.
StoredGrid plainGrid() {
  StoredGrid grid = emptyGrid();
  grid.topology = TopologyKind::kBricks;
  grid.bricks = {{0, 0, 0}, {0, 0, 8}, {8, 0, 0}};
  grid.field.chunks = {{{}, sampleEllipsoids(4, 1, {.kappas = true})}};
  grid.curve = {{10, 4, 31.25, 20.5, 0.25}};
  return grid;
}
std::vector<std::byte> plainFile() { return encodeEsvr(fileOf(plainGrid())); }

void decode(const std::vector<std::byte>& bytes) { (void)decodeEsvr(bytes, "lie.esvr"); }

TEST(HostileFile, AnUnknownOptionalSectionIsSkipped) {
  CraftedFile file(plainFile());
  file.add({SectionKind(kUnknownKind), 7, 8, 9, 10}, 0, bytesOf("later")).entry.codec = Codec(99);
  EXPECT_EQ(difference(decodeEsvr(file.assemble(), "f"), fileOf(plainGrid())), "");
}

TEST(HostileFile, ANewerMinorVersionIsRead) {
  CraftedFile file(plainFile());
  file.versionMinor = 42;
  EXPECT_EQ(difference(decodeEsvr(file.assemble(), "f"), fileOf(plainGrid())), "");
}

TEST(HostileFile, ANewerMajorVersionIsRefusedByItsNumber) {
  CraftedFile file(plainFile());
  file.versionMajor = format::kVersionMajor + 1;
  file.versionMinor = 3;
  EXPECT_THAT(refusalToRead(file.assemble()), Says("format 2.3", "knows 1.6"));
}

TEST(HostileFile, SectionsOfAnyOrderAreRead) {
  CraftedFile file(plainFile());
  for (const auto kind : {SectionKind::kGrid, SectionKind::kCenters}) {
    auto moved = file.section(kind);
    file.erase(kind);
    file.add(moved.entry.id, moved.entry.flags, moved.stored).entry = moved.entry;
  }
  EXPECT_EQ(difference(decodeEsvr(file.assemble(), "f"), fileOf(plainGrid())), "");
}

TEST(HostileFile, LineEndsChangedByATextTransferAreNamed) {
  auto bytes = plainFile();
  bytes.erase(bytes.begin() + 5);  // changes CR LF to LF
  EXPECT_THAT(refusalToRead(bytes), HasSubstr("as text"));
}

/// A change to the sections, and the reader's message.
struct ContentLie {
  const char* name;
  std::function<void(CraftedFile&)> tell;
  const char* answer;
};
void PrintTo(const ContentLie& lie, std::ostream* out) { *out << lie.name; }

class ContentLies : public testing::TestWithParam<ContentLie> {};

TEST_P(ContentLies, AreFoundOut) {
  CraftedFile file(plainFile());
  GetParam().tell(file);
  EXPECT_THAT(refusalToRead(file.assemble()), Says("lie.esvr", GetParam().answer));
}

template <class T>
std::function<void(CraftedFile&)> poke(SectionKind kind, std::size_t offset, T value) {
  return [=](CraftedFile& file) { file.poke(kind, offset, value); };
}
template <class T>
std::function<void(CraftedFile&)> pokeGrid(std::size_t offset, T value) {
  return poke(SectionKind::kGrid, offset, value);
}
std::function<void(CraftedFile&)> without(SectionKind kind) {
  return [=](CraftedFile& file) { file.erase(kind); };
}
std::function<void(CraftedFile&)> resized(SectionKind kind, std::ptrdiff_t by) {
  return [=](CraftedFile& file) {
    auto raw = file.content(kind);
    raw.resize(std::size_t(std::ptrdiff_t(raw.size()) + by));
    file.setContent(kind, std::move(raw));
  };
}
/// Adds a section of an existing kind for another grid or chunk.
std::function<void(CraftedFile&)> stray(SectionKind kind, std::uint32_t grid, std::uint32_t chunk) {
  return [=](CraftedFile& file) {
    file.add({kind, grid, chunk}, format::kRequired, file.content(kind));
  };
}
std::function<void(CraftedFile&)> setEntry(SectionKind kind,
                                           std::function<void(format::SectionEntry&)> set) {
  return [=](CraftedFile& file) { set(file.section(kind).entry); };
}

using K = SectionKind;
using Entry = format::SectionEntry;
constexpr std::uint8_t kNoEnumerator = 200;

const ContentLie kContentLies[] = {
    {"RequiredUnknownKind", [](CraftedFile& f) { f.add({K(kUnknownKind)}, format::kRequired, {}); },
     "must be understood"},
    {"UnknownCodec", setEntry(K::kCenters, [](Entry& e) { e.codec = Codec(4); }),
     "codec 'unknown 0x4' of format 1.0, this reader knows 1.6"},
    {"UnknownFlag", setEntry(K::kCenters, [](Entry& e) { e.flags = 2; }), "flags 2"},
    {"LaterFrame", setEntry(K::kCenters, [](Entry& e) { e.id.frame = 1; }), "frame 1"},
    {"LaterLayer", setEntry(K::kCenters, [](Entry& e) { e.id.layer = 1; }), "layer 1"},
    {"RawSizeTooLarge", setEntry(K::kCenters, [](Entry& e) { e.rawBytes = 1ull << 60; }),
     "cannot hold"},
    {"BloscOfEllipsoids", setEntry(K::kCenters, [](Entry& e) { e.codec = Codec::kBlosc; }),
     "codec 'blosc' is not that of centers"},
    {"FloatsOfABrokenSize",
     [](CraftedFile& f) {
       f.section(K::kGrid).entry.codec = Codec::kFloats;
       f.section(K::kGrid).entry.rawBytes = 131;
     },
     "cannot hold 131"},
    {"NoGrid", without(K::kGrid), "belongs to nothing"},
    {"NoCenters", without(K::kCenters), "there is no centers of grid 0, chunk 0"},
    {"NoScales", without(K::kScales), "there is no scales"},
    {"NoIntensities", without(K::kIntensities), "there is no intensities"},
    {"SecondChunkTable",
     [](CraftedFile& f) {
       f.add({K::kChunks, 0}, 0, std::vector<std::byte>(2 * format::kChunkRecordBytes));
     },
     "belongs to nothing"},
    {"StrayChunk", stray(K::kCenters, 0, 1), "belongs to nothing"},
    {"StrayGrid", stray(K::kCurve, 1, kNone), "belongs to nothing"},
    {"BricksOfAThresholdGrid", pokeGrid(at::kTopology, std::uint8_t{0}), "belongs to nothing"},
    {"GridGap", setEntry(K::kGrid, [](Entry& e) { e.id.grid = 1; }), "there is no grid of grid 0"},
    {"LongName", pokeGrid(at::kNameLength, 0xffffffffu), "ends within a value"},
    {"UnknownClass", pokeGrid(at::kClass, kNoEnumerator), "unknown grid class 200"},
    {"UnknownValueType", pokeGrid(at::kValueType, kNoEnumerator), "unknown value type"},
    {"UnknownTopology", pokeGrid(at::kTopology, kNoEnumerator), "unknown topology"},
    {"TopologyOfNoVersion", pokeGrid(at::kTopology, std::uint8_t{3}), "unknown topology 3"},
    {"NoBoxVoxels", pokeGrid(at::kTopology, std::uint8_t{9}), "box voxels without any"},
    {"UnknownKernel", pokeGrid(at::kKernel, kNoEnumerator), "unknown kernel"},
    {"AffineNeitherNor", pokeGrid(at::kAffine, kNoEnumerator), "unknown mark of an affine"},
    {"WithinRangeNeitherNor", pokeGrid(at::kWithinRange, kNoEnumerator), "unknown mark"},
    {"ManyItems", pokeGrid(at::kItems, 0xffffffffu), "ends within a value"},
    {"BackgroundNan", pokeGrid(at::kBackground, double(kNan)), "background"},
    {"FieldBackgroundNan", pokeGrid(at::kFieldBackground, kNan), "background"},
    {"ThresholdNan", pokeGrid(at::kThreshold, kNan), "threshold"},
    {"ThresholdInfinite", pokeGrid(at::kThreshold, -kInf), "threshold"},
    {"RangeUpsideDown", pokeGrid(at::kValueMin, 5.0f), "range of values"},
    {"KappaNan", pokeGrid(at::kKappa, kNan), "kernel"},
    {"EpsilonZero", pokeGrid(at::kEpsilon, 0.0f), "kernel"},
    {"EpsilonOne", pokeGrid(at::kEpsilon, 1.0f), "kernel"},
    {"FewerChunks", pokeGrid(at::kChunkCount, 0u), "44 bytes too many"},
    {"MoreChunks", pokeGrid(at::kChunkCount, 0xffffffffu), "44 bytes too many"},
    {"GridRecordTooLong", resized(K::kGrid, 1), "1 byte too many"},
    {"GridRecordTooShort", resized(K::kGrid, -1), "ends within a value"},
    {"MoreEllipsoids", pokeGrid(at::kCount, std::uint64_t{5}), "48 bytes of content for 5"},
    {"EllipsoidsOverflow", pokeGrid(at::kCount, (std::uint64_t{1} << 62) + 4), "bytes of content"},
    {"NoEllipsoids", pokeGrid(at::kCount, std::uint64_t{0}), "belongs to nothing"},
    {"BoxWithoutCenters", pokeGrid(at::kChunkBox, 60), "outside the chunk's box"},
    {"CenterNan", poke(K::kCenters, 0, kNan), "the center of ellipsoid 0 is not finite"},
    {"ScaleInfinite", poke(K::kScales, 4, HUGE_VALF), "a scale of ellipsoid 1 is not finite"},
    {"RotationNan", poke(K::kRotations, 8, kNan), "the rotation of ellipsoid 2"},
    {"RotationLong", poke(K::kRotations, 0, 2.0f), "not of unit length"},
    {"IntensityNan", poke(K::kIntensities, 12, kNan), "the intensity of ellipsoid 3"},
    {"EllipsoidKappaNan", poke(K::kKappas, 0, kNan), "the kappa of ellipsoid 0"},
    {"KappasTooFew", resized(K::kKappas, -4), "12 bytes of content for 4"},
    {"RotationsTooMany", resized(K::kRotations, 16), "bytes of content for 4"},
    {"BricksOutOfOrder", poke(K::kBricks, 8, 0), "brick 2 is out of order"},
    {"BricksOutOfRange", poke(K::kBricks, 0, 1 << 30), "outside the index space"},
    {"BricksCutOff", resized(K::kBricks, -1), "whole number of bricks"},
    {"CurveCutOff", resized(K::kCurve, 4), "whole number of points"},
    {"CurveNan", poke(K::kCurve, sizeof(std::uint64_t), double(kNan)), "curve"},
};

INSTANTIATE_TEST_SUITE_P(HostileFile, ContentLies, testing::ValuesIn(kContentLies),
                         [](const auto& lie) { return lie.param.name; });

/// A change to the section table only.
struct TableLie {
  const char* name;
  std::function<void(SectionTable&)> tell;
  const char* answer;
};
void PrintTo(const TableLie& lie, std::ostream* out) { *out << lie.name; }

class TableLies : public testing::TestWithParam<TableLie> {};

TEST_P(TableLies, AreFoundOut) {
  CraftedFile file(plainFile());
  (void)file.assemble();
  SectionTable table = file.table();
  GetParam().tell(table);
  EXPECT_THAT(refusalToRead(file.assembleAs(table)), Says("lie.esvr", GetParam().answer));
}

const TableLie kTableLies[] = {
    {"SizeTooLarge", [](SectionTable& t) { t.fileBytes += 1; }, "truncated"},
    {"SizeTooSmall", [](SectionTable& t) { t.fileBytes -= 1; }, "bytes after its end"},
    {"TableOutside", [](SectionTable& t) { t.tableOffset = ~std::uint64_t{7}; }, "section table"},
    {"TableInHeader", [](SectionTable& t) { t.tableOffset = 0; }, "section table"},
    {"TableUnaligned", [](SectionTable& t) { t.tableOffset += 1; }, "section table"},
    {"SectionOutside", [](SectionTable& t) { t.entries[1].offset = t.fileBytes + 4096; },
     "no room for its "},
    {"SectionOverflows", [](SectionTable& t) { t.entries[1].storedBytes = ~std::uint64_t{0}; },
     "no room for its "},
    {"SectionUnaligned", [](SectionTable& t) { t.entries[1].offset += 1; }, "not aligned"},
    {"SectionInHeader", [](SectionTable& t) { t.entries[1].offset = 0; }, "overlap"},
    {"SectionInTable", [](SectionTable& t) { t.entries[1].offset = t.tableOffset + 8; }, "overlap"},
    {"SectionOnAnother", [](SectionTable& t) { t.entries[1].offset = t.entries[2].offset; },
     "overlap"},
    {"SectionTwice", [](SectionTable& t) { t.entries[1].id = t.entries[2].id; }, "two sections"},
    {"WrongChecksum", [](SectionTable& t) { t.entries[1].checksum ^= 1; },
     "section 1 (centers of grid 0, chunk 0, at byte"},
};

INSTANTIATE_TEST_SUITE_P(HostileFile, TableLies, testing::ValuesIn(kTableLies),
                         [](const auto& lie) { return lie.param.name; });

TEST(HostileFile, BytesBetweenTheSectionsMustBeZero) {
  CraftedFile file(plainFile());
  auto bytes = file.assemble();
  const auto& entries = file.table().entries;
  const auto before = std::ranges::find_if(
      entries, [](const Entry& e) { return e.storedBytes % format::kAlignment != 0; });
  ASSERT_LT(before, entries.end() - 1) << "the file ends with its last section";
  const std::size_t gap = before->offset + before->storedBytes;
  bytes[gap] = std::byte{1};
  EXPECT_THAT(refusalToRead(bytes), HasSubstr("byte " + std::to_string(gap) + " belongs to no"));
}

/// A file of a kilobyte whose sections claim as much content as the reader may believe.
TEST(HostileFile, AKilobyteCannotAskForAGigabyte) {
  CraftedFile file(plainFile());
  for (const auto kind : {K::kCenters, K::kScales, K::kRotations, K::kIntensities, K::kKappas,
                          K::kBricks, K::kCurve, K::kGrid}) {
    auto& section = file.section(kind);
    section.entry.codec = Codec::kBytes;
    for (std::uint64_t raw = std::uint64_t{1} << 50; raw > 0; raw /= 2) {
      section.entry.rawBytes = raw;
      const auto bytes = file.assemble();
      ASSERT_LT(bytes.size(), 1024u + 512u);
      const AllocationMeter meter;
      EXPECT_THROW(decode(bytes), BadInput);
      EXPECT_LT(meter.bytes(), 32 * kMegabyte) << "raw size " << raw;
    }
  }
}

/// Zeros compress best, so no small file holds more.
TEST(HostileFile, TheMemoryOfASmallFileIsBounded) {
  StoredGrid grid = emptyGrid();
  grid.descriptor.metadata = {{"zeros", "string", std::vector<std::byte>(4 * kMegabyte)}};
  const auto bytes = encodeEsvr(fileOf(grid));
  const AllocationMeter meter;
  EXPECT_EQ(decodeEsvr(bytes, "zeros").grids.size(), 1u);
  EXPECT_LT(meter.bytes(), 16 * kMegabyte);
  EXPECT_LT(bytes.size(), 8192u);
}

// ---- Limits on memory

StoredGrid gridOfScale(float logScale) {
  StoredGrid grid = emptyGrid();
  grid.descriptor.name = "smoke";
  grid.withinRange = false;
  grid.activeBox = {{-100'000, -100'000, -100'000}, {100'000, 100'000, 100'000}};
  grid.field.chunks = {{{}, sampleEllipsoids(4, 1)}};
  grid.field.chunks[0].ellipsoids.logScale[1][2] = logScale;
  return grid;
}

EsvrFile readWithin(const std::vector<std::byte>& bytes, std::uint64_t maxBytes) {
  return format::decode(format::MemorySource(bytes, "small.esvr"), {maxBytes});
}

void expectRefused(const EsvrFile& file, std::uint64_t maxBytes) {
  const auto bytes = encodeEsvr(file);
  EXPECT_EQ(difference(readWithin(bytes, kNoMemoryLimit), file), "");
  const AllocationMeter meter;
  EXPECT_THAT([&] { (void)readWithin(bytes, maxBytes); },
              ThrowsSaying<MemoryExceeded>("small.esvr", "MB are allowed"));
  EXPECT_LT(meter.bytes(), maxBytes);
}

TEST(Limits, OneHugeScaleIsRefusedBeforeAnythingIsEvaluated) {
  StoredGrid grid = gridOfScale(6.0f);
  for (auto& scale : grid.field.chunks[0].ellipsoids.logScale) scale[2] = 6.0f;
  const DecodeOptions options{.maxBytes = 1000 * kMegabyte};
  EXPECT_GT(estimateDecode(grid, options).bytes(), 5e9);
  const AllocationMeter meter;
  EXPECT_THAT([&] { (void)decodeGrid(grid, options); },
              ThrowsSaying<MemoryExceeded>("smoke", "1.05 GB"));
  EXPECT_LT(meter.bytes(), kMegabyte);
}

TEST(Limits, ABoxOfAHugeScaleIsDecoded) {
  StoredGrid grid = gridOfScale(0.0f);
  for (auto& scale : grid.field.chunks[0].ellipsoids.logScale) scale[2] = 18.0f;
  const DecodeOptions options{.box = Box{{0, 0, 0}, {15, 7, 7}}, .maxBytes = 100 * kMegabyte};
  EXPECT_EQ(decodeGrid(grid, options).brickCount(), 2u);
}

TEST(Limits, StoredBricksBoundTheWorkOfAHugeScale) {
  StoredGrid grid = gridOfScale(0.0f);
  for (auto& scale : grid.field.chunks[0].ellipsoids.logScale) scale[2] = 30.0f;
  grid.topology = TopologyKind::kBricks;
  grid.bricks = {{0, 0, 0}, {0, 0, 8}, {8000, 0, 0}};
  EXPECT_LE(decodeGrid(grid, {.maxBytes = 100 * kMegabyte}).brickCount(), 3u);
}

class ExtremeScale : public testing::TestWithParam<float> {};

TEST_P(ExtremeScale, IsNeitherWrittenNorBelieved) {
  const StoredGrid grid = gridOfScale(GetParam());
  EXPECT_THAT(refusalToWrite(fileOf(grid)), HasSubstr("a scale of ellipsoid 2"));
  CraftedFile file(encodeEsvr(fileOf(gridOfScale(0.0f))));
  file.poke(SectionKind::kScales, (4 + 2) * sizeof(float), GetParam());
  EXPECT_THAT(refusalToRead(file.assemble()), Says("lie.esvr", "a scale of"));
}
INSTANTIATE_TEST_SUITE_P(Scales, ExtremeScale, testing::Values(33.0f, 1e3f, 3e38f, -33.0f, -1e30f));

TEST(Limits, MetadataThatIsWideInMemoryIsRefused) {
  EsvrFile file = fileOf(emptyGrid());
  file.metadata.assign(100'000, MetaItem{});
  expectRefused(file, 4 * kMegabyte);
}

TEST(Limits, SlowVoxelsThatCostNextToNothingAreRefused) {
  std::vector<Coord> corners;
  for (int i = 0; i < 2000; ++i) corners.push_back({8 * (i % 100), 8 * (i / 100), 0});
  StoredGrid grid = emptyGrid();
  grid.field.background = 0.0f;
  grid.voxels = exactLayer(fullBricks(corners, 0.0f, [](Coord) { return 1.0f; }));
  const EsvrFile file = fileOf(grid);
  EXPECT_LT(encodeEsvr(file).size(), 8'000u);
  expectRefused(file, 8 * kMegabyte);
}

// ---- Damage by accident

using Bytes = std::vector<std::byte>;

/// A file with all kinds of sections and padding between them, small enough to damage every byte.
EsvrFile smallFile() { return everything(3); }

TEST(Damage, TruncationAtEveryByteIsRefused) {
  const Bytes whole = encodeEsvr(smallFile());
  ASSERT_FALSE(isRefused(whole));
  for (std::size_t n = 0; n < whole.size(); ++n)
    EXPECT_TRUE(isRefused({whole.begin(), whole.begin() + std::ptrdiff_t(n)})) << n;
}

TEST(Damage, SlowAnyBitFlippedIsRefused) {
  Bytes bytes = encodeEsvr(smallFile());
  // A checksum sees every bit of a section alike; the bytes before the sections have meanings of their own.
  constexpr std::size_t kHead = 256;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    for (int bit = 0; bit < 8; ++bit) {
      if (i >= kHead && bit != int(i % 8)) continue;
      bytes[i] ^= std::byte(1 << bit);
      EXPECT_TRUE(isRefused(bytes)) << "byte " << i << ", bit " << bit;
      bytes[i] ^= std::byte(1 << bit);
    }
}

TEST(Damage, BytesAfterTheEndAreRefused) {
  Bytes bytes = encodeEsvr(smallFile());
  bytes.push_back({});
  EXPECT_TRUE(isRefused(bytes));
}

/// Applies one to eight of these: changes a byte, cuts a run out, repeats a run elsewhere, reverses
/// a run.
class Mutator {
 public:
  explicit Mutator(std::uint32_t seed) : pass_(seed) {}

  Bytes mutated(Bytes bytes) {
    for (std::size_t n = 1 + below(8); n > 0; --n) mutate(bytes);
    return bytes;
  }

 private:
  std::size_t below(std::size_t n) { return std::size_t(pass_()) % n; }

  void mutate(Bytes& bytes) {
    const std::size_t length = 1 + below(std::min<std::size_t>(16, bytes.size() / 2));
    const auto at = [&] { return std::ptrdiff_t(below(bytes.size() - length + 1)); };
    const auto a = bytes.begin() + at(), b = bytes.begin() + at();
    switch (below(4)) {
      case 0:
        *a = std::byte(below(256));
        break;
      case 1:
        bytes.erase(a, a + std::ptrdiff_t(length));
        break;
      case 2: {
        const Bytes run(a, a + std::ptrdiff_t(length));
        bytes.insert(b, run.begin(), run.end());
        break;
      }
      default:
        std::reverse(a, a + std::ptrdiff_t(length));
    }
  }

  std::mt19937 pass_;
};

TEST(Damage, TenThousandMutationsAreRefusedOrChangeNothing) {
  const EsvrFile original = smallFile();
  const Bytes whole = encodeEsvr(original);
  Mutator mutator(20240601);
  int accepted = 0;
  for (int i = 0; i < 10'000; ++i) {
    const Bytes bytes = mutator.mutated(whole);
    try {
      EXPECT_EQ(difference(decodeEsvr(bytes, "mutated"), original), "") << i;
      ++accepted;
    } catch (const BadInput&) {
    }
  }
  EXPECT_LT(accepted, 500);  // mutations that changed nothing
}

// ---- Sequences

class SequenceDamage : public testing::Test {
 protected:
  SequenceDamage() {
    writeChains(path(), {{1, 2, 3}, {5, 6}});
    whole_ = bytesIn(path());
    frames_ = SequenceReader(path()).frames();
  }
  [[nodiscard]] std::filesystem::path path() const { return folder_ / "a.esvr"; }
  void damage(std::size_t at) const {
    Bytes bytes = whole_;
    bytes[at] ^= std::byte{0x10};
    writeBytes(path(), bytes);
  }
  /// The index of the frame that has a byte; the number of frames if none has it.
  [[nodiscard]] std::size_t frameAt(std::size_t at) const {
    const auto has = [&](const SequenceFrame& f) {
      return at >= f.offset && at < f.offset + f.bytes;
    };
    return std::size_t(std::ranges::find_if(frames_, has) - frames_.begin());
  }
  /// True if a frame cannot be read when the damaged frame is lost.
  [[nodiscard]] bool isLost(std::size_t frame, std::size_t damaged) const {
    return damaged < frames_.size() && frame >= damaged &&
           frames_[frame].group == frames_[damaged].group;
  }
  static bool canRead(SequenceReader& reader, std::int64_t number) try {
    return difference(reader.read(number), sampleFrame(number)).empty();
  } catch (const BadInput&) {
    return false;
  }

  TemporaryFolder folder_;
  Bytes whole_;
  std::vector<SequenceFrame> frames_;
};

/// True if the check finds a fault or refuses the file.
bool isFound(const std::filesystem::path& path) try {
  return !checkSequence(path).empty();
} catch (const BadInput&) {
  return true;
}

TEST_F(SequenceDamage, IsFoundAnywhere) {
  EXPECT_FALSE(isFound(path()));
  for (std::size_t at = 0; at < whole_.size(); at += stride(3)) {
    damage(at);
    EXPECT_TRUE(isFound(path())) << at;
  }
}

TEST_F(SequenceDamage, LosesNoOtherFrames) {
  const std::size_t end = frames_.back().offset + frames_.back().bytes;
  for (std::size_t at = frames_.front().offset; at < end; at += stride(3)) {
    damage(at);
    SequenceReader reader(path());
    for (std::size_t i = 0; i < frames_.size(); ++i)
      EXPECT_EQ(canRead(reader, frames_[i].number), !isLost(i, frameAt(at)))
          << "byte " << at << ", frame " << frames_[i].number;
  }
}

TEST_F(SequenceDamage, IsToldForEachFrameThatIsLost) {
  damage(frames_[1].offset + 1);
  std::vector<std::optional<std::int64_t>> lost;
  for (const SequenceFault& fault : checkSequence(path())) lost.push_back(fault.frame);
  EXPECT_EQ(lost, (std::vector<std::optional<std::int64_t>>{2, 3}));
}

TEST_F(SequenceDamage, IsTruncationAnywhere) {
  for (std::size_t n = 0; n < whole_.size(); n += 1 + (whole_.size() - 1 - n) / 16) {
    writeBytes(path(), {whole_.begin(), whole_.begin() + std::ptrdiff_t(n)});
    EXPECT_THROW(SequenceReader{path()}, BadInput) << n;
  }
}

TEST_F(SequenceDamage, OfAPartialFileRemovesTheGroupAndThoseAfterIt) {
  std::filesystem::rename(path(), folder_ / "b.esvr");
  {
    SequenceWriter writer(path());
    for (const std::int64_t number : {1, 2}) {
      writer.append(number, encodeEsvr(sampleFrame(number)));
      writer.endGroup();
    }
  }
  Bytes bytes = bytesIn(SequenceWriter::partialPath(path()));
  bytes[bytes.size() / 4] ^= std::byte{1};
  writeBytes(SequenceWriter::partialPath(path()), bytes);
  const SequenceWriter writer(path(), {.partial = PartialSequence::kResume});
  EXPECT_EQ(writer.groupCount(), 0u);
}

}  // namespace

}  // namespace esvr::test
