#include "format/sample_files.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <iterator>
#include <random>
#include <stdexcept>

#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/sequence_file.h"
#include "fit/volumes.h"
#include "format/bytes.h"
#include "format/non_finite_section.h"
#include "format/section_writer.h"
#include "format/sequence_file.h"
#include "support/non_finite.h"

namespace esvr::test {
namespace {

/// Random numbers that are the same on every machine, which the standard's distributions do not
/// promise.
class Numbers {
 public:
  explicit Numbers(std::uint32_t seed) : pass_(seed) {}
  /// A number on a lattice of 2^-16 of the range, so that arithmetic with it is exact.
  float between(float low, float high) {
    return low + (high - low) * float(pass_() >> 16) / 65536.0f;
  }

 private:
  std::mt19937 pass_;
};

/// Pythagorean quaternions, whose length is exactly 1 in any arithmetic.
constexpr float kUnitQuaternions[][4] = {
    {0.5f, 0.5f, 0.5f, 0.5f}, {0.5f, -0.5f, 0.5f, -0.5f}, {0.0f, 0.6f, 0.8f, 0.0f},
    {0.8f, 0.0f, 0.0f, 0.6f}, {0.1f, 0.5f, 0.7f, 0.5f},   {0.7f, -0.1f, 0.5f, 0.5f},
};

void setRotations(Ellipsoids& e, bool any) {
  for (std::size_t i = 0; i < e.size(); ++i)
    for (std::size_t c = 0; c < 4; ++c)
      e.rotation[c][i] = any ? kUnitQuaternions[i % std::size(kUnitQuaternions)][c] : c == 0;
}

template <class T>
bool sameBits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}
bool sameBits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

template <std::size_t N>
bool sameBits(const std::array<std::vector<float>, N>& a,
              const std::array<std::vector<float>, N>& b) {
  for (std::size_t i = 0; i < N; ++i)
    if (!sameBits(a[i], b[i])) return false;
  return true;
}

std::string differenceOf(const Ellipsoids& a, const Ellipsoids& b) {
  if (!sameBits(a.center, b.center)) return "centers";
  if (!sameBits(a.logScale, b.logScale)) return "scales";
  if (!sameBits(a.rotation, b.rotation)) return "rotations";
  if (!sameBits(a.intensity, b.intensity)) return "intensities";
  if (!sameBits(a.kappa, b.kappa)) return "kappas";
  return "";
}

std::string differenceOf(const Field& a, const Field& b) {
  if (!sameBits(a.background, b.background)) return "background of the field";
  if (!(a.kernel == b.kernel)) return "kernel";
  if (a.chunks.size() != b.chunks.size()) return "number of chunks";
  for (std::size_t c = 0; c < a.chunks.size(); ++c) {
    if (a.chunks[c].origin != b.chunks[c].origin) return "origin of a chunk";
    const auto text = differenceOf(a.chunks[c].ellipsoids, b.chunks[c].ellipsoids);
    if (!text.empty()) return text;
  }
  return "";
}

std::string differenceOf(const StoredGrid& a, const StoredGrid& b) {
  if (!(a.descriptor == b.descriptor)) return "descriptor";
  if (!sameBits(a.descriptor.background, b.descriptor.background)) return "background";
  if (a.topology != b.topology || a.bricks != b.bricks || a.mask != b.mask) return "topology";
  if (!sameBits(a.activeThreshold, b.activeThreshold)) return "threshold";
  if (a.withinRange != b.withinRange) return "withinRange";
  if (!(a.tone == b.tone)) return "tone";
  if (a.boxVoxels != b.boxVoxels) return "box voxels";
  if (!(a.activeBox == b.activeBox) || a.activeVoxels != b.activeVoxels) return "active voxels";
  if (!sameBits(a.valueMin, b.valueMin) || !sameBits(a.valueMax, b.valueMax)) return "value range";
  if (a.curve != b.curve) return "curve";
  if (a.voxels != b.voxels) return "voxels";
  if (a.residual != b.residual) return "residual";
  if (a.nonFiniteVoxels != b.nonFiniteVoxels || !(a.nonFinite == b.nonFinite))
    return "voxels that are not finite";
  if (a.quantised != b.quantised) return "quantised";
  if (a.layerErrors != b.layerErrors) return "errors of layers";
  return differenceOf(a.field, b.field);
}

}  // namespace

Ellipsoids sampleEllipsoids(std::size_t n, std::uint32_t seed, EllipsoidParts parts) {
  Numbers numbers(seed);
  Ellipsoids e;
  e.resize(n, parts.kappas);
  for (std::size_t i = 0; i < n; ++i) {
    for (auto& center : e.center) center[i] = numbers.between(0.0f, 64.0f);
    for (auto& scale : e.logScale) scale[i] = numbers.between(-1.0f, 3.0f);
    e.intensity[i] = numbers.between(-0.25f, 1.0f);
    if (parts.kappas) e.kappa[i] = numbers.between(-2.0f, 8.0f);
  }
  setRotations(e, parts.rotations);
  return format::inMortonOrder(e);
}

StoredGrid fogGrid(std::size_t ellipsoids) {
  StoredGrid grid;
  auto& d = grid.descriptor;
  d.name = "density";
  d.gridClass = GridClass::kFogVolume;
  d.valueType = ValueType::kHalf;
  d.transform.mapType = "UniformScaleMap";
  d.transform.map = bytesOf(std::string(120, 'm'));  // of the right size; nothing reads them
  d.transform.affine = {0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 1, 2, 3, 1};
  d.metadata = {{"is_local_space", "bool", bytesOf(std::string("\0", 1))},
                {"note", "string", bytesOf("from the sample")}};
  grid.field.kernel.kappa = 2.5f;
  grid.field.chunks = {{{-16, 8, 4096}, sampleEllipsoids(ellipsoids, 1)}};
  grid.activeThreshold = 0.125f;
  grid.activeBox = {{-16, 8, 4096}, {47, 71, 4159}};
  grid.activeVoxels = 12345;
  grid.valueMax = 1.5f;
  grid.curve = {{10, 100, 31.25, 20.5, 0.25}, {30, 200, 41.25, 30.5, 0.125}};
  return grid;
}

StoredGrid levelSetGrid(std::size_t ellipsoids) {
  StoredGrid grid;
  auto& d = grid.descriptor;
  d.name = "surface";
  d.gridClass = GridClass::kLevelSet;
  d.valueType = ValueType::kDouble;
  d.background = 0.3;
  d.transform.mapType = "NonlinearFrustumMap";
  d.transform.map = bytesOf("frustum");
  grid.field.background = 0.3f;
  grid.field.kernel = {KernelForm::kPaper, 5.0f, Kernel::kDefaultEpsilon};
  grid.field.chunks = {{{}, sampleEllipsoids(ellipsoids, 2, {.rotations = false})}};
  grid.topology = TopologyKind::kBricks;
  grid.bricks = {{-8, -8, 1 << 20}, {-8, 0, 0}, {0, -16, 8}, {0, 0, -8}};
  grid.withinRange = false;
  grid.activeBox = {{-8, -16, -8}, {7, 7, (1 << 20) + 7}};
  grid.activeVoxels = 4;
  grid.valueMin = -0.3f;
  grid.valueMax = 0.3f;
  return grid;
}

StoredGrid chunkedGrid(std::size_t ellipsoidsPerChunk) {
  StoredGrid grid;
  grid.descriptor.name = "wide";
  grid.descriptor.transform.mapType = "AffineMap";
  grid.field.chunks = {
      {{0, 0, 0}, sampleEllipsoids(ellipsoidsPerChunk, 3, {.rotations = false})},
      {{kChunkExtent, 0, 0}, {}},
      {{0, -kChunkExtent, 10'000'000}, sampleEllipsoids(ellipsoidsPerChunk, 4, {.kappas = true})}};
  grid.activeBox = {{0, -kChunkExtent, 0}, {63, 63, 10'000'063}};
  grid.activeVoxels = std::uint64_t{1} << 40;
  return grid;
}

namespace {

/// The three highest of the given precisions, each of which becomes a layer.
std::vector<std::uint8_t> threeHighest(std::vector<std::uint8_t> precision) {
  std::sort(precision.begin(), precision.end(), std::greater<>());
  precision.erase(std::unique(precision.begin(), precision.end()), precision.end());
  if (precision.size() > 1) precision.pop_back();  // the last layer needs no precision of its own
  if (precision.size() > 3) precision.resize(3);
  return precision;
}

StoredGrid quantised(std::size_t ellipsoidsPerChunk, bool layered) {
  StoredGrid grid = emptyGrid();
  grid.descriptor.name = "compact";
  const std::vector<double> curvature(ellipsoidsPerChunk, 4.0);
  for (std::uint32_t c = 0; c < 2; ++c) {
    Ellipsoids e = sampleEllipsoids(ellipsoidsPerChunk, 5 + c);
    if (c == 0)
      for (float& intensity : e.intensity) intensity = std::abs(intensity);
    auto choice = chooseLattice(e, curvature, {0.05, 0.05, 0.05, 0.05});
    choice.layerFrom.clear();
    if (layered) choice.layerFrom = threeHighest(choice.precision);
    std::vector<std::size_t> order;
    grid.quantised.push_back(quantise(e, choice, order));
    grid.field.chunks.push_back(
        {{std::int32_t(c) * kChunkExtent, 0, 0}, dequantise(grid.quantised.back())});
  }
  return grid;
}

}  // namespace

StoredGrid quantisedGrid(std::size_t ellipsoidsPerChunk) {
  return quantised(ellipsoidsPerChunk, false);
}

StoredGrid layeredGrid(std::size_t ellipsoidsPerChunk) {
  StoredGrid grid = quantised(ellipsoidsPerChunk, true);
  for (std::size_t k = 0; layerCount(grid) > 1 && k < layerCount(grid); ++k)
    grid.layerErrors.push_back({20.0f + 5.0f * float(k), 1.0f / float(1 + k)});
  return grid;
}

StoredGrid corrected(StoredGrid grid) {
  VoxelLayer& residual = grid.residual.emplace();
  residual.form = VoxelForm::kQuantised;
  residual.divisor = 64.0;
  residual.origin = {8, -24, 1024};
  residual.bricks = {{}};
  residual.codes.resize(kBrickVoxels);
  residual.codes[0] = 3, residual.codes[77] = -2, residual.codes[511] = 1;
  residual.active.resize(1);
  residual.active[0].setAll();
  residual.vacant.resize(1);
  return grid;
}

StoredGrid emptyGrid() {
  StoredGrid grid;
  grid.descriptor.background = grid.field.background = 1.0f;
  return grid;
}

CarriedGrid carriedGrid(std::uint32_t place, const std::string& bytes) {
  const auto content = bytesOf(bytes);
  return {.name = "velocity",
          .treeType = "Tree_vec3s_5_4_3",
          .savedAsHalf = true,
          .vdbVersion = 224,
          .place = place,
          .blocksAt = 5,
          .bytes = {content.begin(), content.end()}};
}

EsvrFile everything(std::size_t ellipsoids) {
  StoredGrid twin = fogGrid(ellipsoids);
  twin.descriptor.name = "twin of density";
  return {{{"creator", "string", bytesOf("Houdini/GEO_VDBTranslator")}},
          {fogGrid(ellipsoids), levelSetGrid(ellipsoids), chunkedGrid(ellipsoids),
           quantisedGrid(ellipsoids), layeredGrid(ellipsoids), emptyGrid(), twin},
          {carriedGrid(0, "vectors"), carriedGrid(4, std::string(1000, 'v'))}};
}

EsvrFile fileOf(StoredGrid grid) { return {{}, {std::move(grid)}}; }

std::string difference(const EsvrFile& a, const EsvrFile& b) {
  if (a.metadata != b.metadata) return "metadata";
  if (a.grids.size() != b.grids.size()) return "number of grids";
  for (std::size_t g = 0; g < a.grids.size(); ++g) {
    const auto text = differenceOf(a.grids[g], b.grids[g]);
    if (!text.empty()) return "grid " + std::to_string(g) + ": " + text;
  }
  if (a.carried != b.carried) return "carried grids";
  if (a.vectors != b.vectors) return "vectors";
  return "";
}

std::string lossOf(const EsvrFile& file) {
  return difference(decodeEsvr(encodeEsvr(file), "memory"), file);
}

std::string refusalToRead(const std::vector<std::byte>& bytes) try {
  (void)decodeEsvr(bytes, "lie.esvr");
  return "none";
} catch (const BadInput& error) {
  return error.what();
}

std::string refusalToWrite(const EsvrFile& file) try {
  (void)encodeEsvr(file);
  return "none";
} catch (const RuntimeFailure& error) {
  return error.what();
}

bool isRefused(const std::vector<std::byte>& bytes) { return refusalToRead(bytes) != "none"; }

// ---- The golden files

namespace {

constexpr auto kKindOfNoVersion = format::SectionKind(0x7e57);

/// Every number is written here, and none is computed.
StoredGrid oneEllipsoid() {
  StoredGrid grid = emptyGrid();
  grid.descriptor.name = "density";
  Ellipsoids e;
  e.resize(1);
  e.center = {{{1.5f}, {-2.25f}, {1000.0f}}};
  e.logScale = {{{0.0f}, {-1.0f}, {2.5f}}};
  e.rotation = {{{0.8f}, {0.0f}, {-0.6f}, {0.0f}}};
  e.intensity = {0.75f};
  grid.field.chunks = {{{10, -20, 30}, e}};
  return grid;
}

/// A ramp of a few values in two bricks, with an inactive voxel that is not the background.
StoredGrid fewValues() {
  const SparseVolume volume = bricksAt(
      {{-8, 16, 0}, {-8, 16, 8}}, 0.125f,
      [](Coord at) { return float((at.x + at.y * at.z / 4) & 15) * 0.125f; },
      [](Coord at) {
        return at.z > 2 || at == Coord{-5, 18, 1};
      });
  return makeStoredVoxels({}, volume, exactLayer(volume));
}

/// The few values, of which four in a row are NaN and the last one is minus infinity.
StoredGrid notAllFinite() {
  StoredGrid grid = fewValues();
  SparseVolume volume = volumeOf(*grid.voxels);
  const auto first = volume.brickValues(0), last = volume.brickValues(1);
  std::fill_n(first.begin() + voxelOffset({2, 3, 4}), 4, kNan);
  last.back() = -kInf;
  grid.nonFiniteVoxels = format::nonFiniteLayer(volume);
  grid.nonFinite = format::countsOf(*grid.nonFiniteVoxels);
  return grid;
}

/// A palette of positive values as floats, whose order is that of their bits.
VoxelLayer asFloats(VoxelLayer layer) {
  layer.form = VoxelForm::kFloat;
  for (auto& code : layer.codes)
    code = std::bit_cast<std::int32_t>(layer.palette[std::size_t(code)]);
  layer.palette.clear();
  return layer;
}

/// 16 x 8 x 8 floats that are equal under a mirror along x but for one voxel, many of them 0.5.
StoredGrid mirroredValues() {
  const auto fromBorder = [](Coord at) { return std::min(at.x, 15 - at.x); };
  const auto number = [&](Coord at) {
    return (fromBorder(at) * 64 + (at.y + 8) * 8 + at.z - 8) * 37 % 512;
  };
  const auto value = [&](Coord at) {
    const auto n = float(number(at));
    return at.z % 3 == 0 || at == Coord{9, -6, 10} ? 0.5f : 1.0f + n * n / 65536.0f;
  };
  const SparseVolume volume = bricksAt({{0, -8, 8}, {8, -8, 8}}, 0.0f, value, [&](Coord at) {
    return fromBorder(at) > 1 || number(at) % 5 != 0;
  });
  return makeStoredVoxels({}, volume, asFloats(exactLayer(volume)));
}

/// 32 x 8 x 16 floats that repeat along z after a brick and are equal under a mirror along x.
StoredGrid copiedValues() {
  std::vector<Coord> corners;
  for (int b = 0; b < 8; ++b) corners.push_back(Coord{b / 2, 2, b % 2} * kBrickSide);
  const auto number = [](Coord at) {
    return std::min(at.x, 31 - at.x) * 64 + (at.y & 7) * 8 + (at.z & 7);
  };
  const SparseVolume volume = bricksAt(
      corners, 0.0f, [&](Coord at) { return float(number(at) * number(at) % 11); },
      [&](Coord at) { return number(at) % 5 != 0; });
  return makeStoredVoxels({}, volume, asFloats(exactLayer(volume)));
}

/// An ellipsoid with the mask of the few values.
StoredGrid masked() {
  StoredGrid grid = oneEllipsoid();
  const SparseVolume volume = volumeOf(*fewValues().voxels);
  grid.topology = TopologyKind::kMask;
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    grid.bricks.push_back(volume.brickCorner(b));
  grid.mask = volume.active;
  return grid;
}

/// An ellipsoid with voxels that touch all faces of its active box.
StoredGrid withBoxVoxels() {
  StoredGrid grid = oneEllipsoid();
  grid.activeBox = {{-100, -24, 0}, {300, -9, 2000}};
  grid.boxVoxels = {{-100, -20, 2000}, {7, -9, 5}, {300, -24, 0}};
  return grid;
}

/// An ellipsoid whose values are those of a tone curve.
StoredGrid withTone() {
  StoredGrid grid = withBoxVoxels();
  grid.field.background = 0.0f;
  grid.descriptor.background = 0.0;
  grid.withinRange = true;
  grid.tone.scale = 0.0425f;
  return grid;
}

/// Two grids with the same ellipsoids and the same mask.
EsvrFile twins() {
  EsvrFile file{{}, {masked(), masked()}};
  file.grids[1].descriptor.name = "color";
  return file;
}

/// A grid of numbers and one of vectors after it.
EsvrFile vectors() {
  EsvrFile file{{}, {fewValues(), oneEllipsoid(), oneEllipsoid(), oneEllipsoid()}};
  for (std::size_t c = 0; c < kComponents; ++c)
    file.grids[1 + c].descriptor.name = componentName("velocity", c);
  file.vectors = {{"velocity", 1}};
  return file;
}

/// Twice the few values plus a half, with the few values as reference, and other values without one.
EsvrFile related() {
  EsvrFile file{{}, {fewValues(), fewValues(), fewValues()}};
  for (float& value : file.grids[1].voxels->palette) value = 2.0f * value + 0.5f;
  file.grids[1].voxels->background = 0.75f;
  file.grids[1].reference = VoxelReference{0, 2.0f, 0.5f};
  file.grids[2].reference = VoxelReference{};
  return file;
}

/// A grid whose record has few bytes in common with that of another one, so that compressing both
/// together saves too little.
StoredGrid unlike(const std::string& name, std::int32_t n) {
  StoredGrid grid = oneEllipsoid();
  grid.descriptor.name = name;
  grid.descriptor.transform.mapType = "map of " + name;
  auto& rows = grid.descriptor.transform.affine.emplace();
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = 1.0 / (n + 2.0 * double(i));
  grid.descriptor.background = 1.0 / n;
  grid.activeBox = {{n * 65537, n * 91193, n * 77417}, {n * 165533, n * 191189, n * 177421}};
  grid.activeVoxels = std::uint64_t(n) * 0x123456789abcdef;
  grid.valueMin = -1.0f / float(n), grid.valueMax = 7.0f / float(n);
  grid.activeThreshold = 0.01f / float(n);
  grid.field.background = 3.0f / float(n);
  grid.field.kernel.kappa = 5.0f / float(n);
  return grid;
}

/// Two grids in the compact layout.
EsvrFile packed() {
  EsvrFile file{{}, {unlike("density", 3), unlike("temperature", 101)}};
  file.layout = FileLayout::kCompact;
  return file;
}

}  // namespace

std::vector<GoldenFile> goldenFiles() {
  return {
      {"no_grid", {}},
      {"one_ellipsoid", fileOf(oneEllipsoid())},
      {"two_grids", {everything(0).metadata, {fogGrid(3), levelSetGrid(2)}}},
      {"level_set", fileOf(levelSetGrid(2))},
      {"kappas_and_chunks", fileOf(chunkedGrid(4))},
      {"compressed", fileOf(fogGrid(60))},
      {"quantised", fileOf(quantisedGrid(20))},
      {"layered", fileOf(layeredGrid(20))},
      {"voxels", fileOf(fewValues())},
      {"mirrored_voxels", fileOf(mirroredValues())},
      {"copied_voxels", fileOf(copiedValues())},
      {"non_finite", fileOf(notAllFinite())},
      {"mask", fileOf(masked())},
      {"box_voxels", fileOf(withBoxVoxels())},
      {"tone", fileOf(withTone())},
      {"twins", twins()},
      {"residual", fileOf(corrected(oneEllipsoid()))},
      {"carried",
       {{}, {oneEllipsoid()}, {carriedGrid(0, "vectors"), carriedGrid(2, "more vectors")}}},
      {"vector_grid", vectors()},
      {"related_voxels", related()},
      {"packed", packed()},
      {"unknown_section", fileOf(oneEllipsoid()), true},
  };
}

std::vector<std::byte> bytesOf(const GoldenFile& golden) {
  const auto bytes = encodeEsvr(golden.content);
  if (!golden.unknownSection) return bytes;
  CraftedFile file(bytes);
  file.add({kKindOfNoVersion, 0}, 0, bytesOf("of a later version"));
  return file.assemble();
}

// ---- Sequences

namespace {

constexpr std::int64_t kEmptyEvery = 5;

void appendTo(std::vector<std::byte>& file, const std::vector<std::byte>& bytes) {
  file.insert(file.end(), bytes.begin(), bytes.end());
  file.resize(format::alignUp(file.size()));
}

void appendChain(std::vector<std::byte>& file, const std::vector<std::int64_t>& numbers,
                 std::vector<format::FrameGroup>& groups) {
  format::FrameGroup group{format::endOf(groups), {}};
  std::vector<std::vector<std::byte>> frames;
  for (const std::int64_t number : numbers) {
    frames.push_back(encodeFrame(sampleFrame(number), nullptr));
    group.frames.push_back(
        {number, frames.back().size(), format::checksum(frames.back()), frames.size() > 1});
  }
  appendTo(file, format::encodeDirectory(group));
  for (const auto& frame : frames) appendTo(file, frame);
  groups.push_back(group);
}

std::vector<std::byte> goldenFrame(const std::string& name) {
  const auto all = goldenFiles();
  const auto golden = std::ranges::find(all, name, &GoldenFile::name);
  return encodeFrame(golden->content, nullptr);
}

}  // namespace

void writeGoldenSequence(const std::filesystem::path& path) {
  SequenceWriter writer(path, {.overwrite = true});
  writer.append(-2, goldenFrame("one_ellipsoid"));
  writer.append(1, goldenFrame("no_grid"));
  writer.endGroup();
  writer.append(3, goldenFrame("voxels"));
  (void)writer.finish();
}

EsvrFile sampleFrame(std::int64_t number) {
  if (number % kEmptyEvery == 0) return {};
  EsvrFile file = fileOf(fogGrid(std::size_t(3 + (number < 0 ? -number : number) % 7)));
  file.grids.front().valueMax += float(number % 3);
  return file;
}

void writeSequence(const std::filesystem::path& path,
                   const std::vector<std::vector<std::int64_t>>& groups) {
  SequenceWriter writer(path);
  for (const auto& group : groups) {
    for (const std::int64_t number : group)
      writer.append(number, encodeFrame(sampleFrame(number), nullptr));
    writer.endGroup();
  }
  (void)writer.finish();
}

void writeChains(const std::filesystem::path& path,
                 const std::vector<std::vector<std::int64_t>>& numbers) {
  std::vector<std::byte> file(format::kHeaderBytes);
  std::vector<format::FrameGroup> groups;
  for (const auto& group : numbers) appendChain(file, group, groups);
  const format::SequenceEnd end = format::encodeEnd(groups);
  file.insert(file.end(), end.bytes.begin(), end.bytes.end());
  std::copy(end.header.begin(), end.header.end(), file.begin());
  writeBytes(path, file);
}

// ---- Files that lie

using namespace format;

CraftedFile::CraftedFile(const std::vector<std::byte>& bytes) {
  const MemorySource source(bytes, "crafted");
  const SectionTable table = readTable(source);
  versionMajor = table.versionMajor;
  versionMinor = table.versionMinor;
  for (std::size_t i = 0; i < table.entries.size(); ++i)
    sections_.push_back({table.entries[i], readStored(source, table, i)});
}

CraftedSection& CraftedFile::section(SectionKind kind) {
  const auto it = std::find_if(sections_.begin(), sections_.end(),
                               [kind](const auto& s) { return s.entry.id.kind == kind; });
  if (it == sections_.end()) throw std::logic_error("no such section in the crafted file");
  return *it;
}

void CraftedFile::erase(SectionKind kind) {
  sections_.erase(sections_.begin() + (&section(kind) - sections_.data()));
}

CraftedSection& CraftedFile::add(const SectionId& id, std::uint16_t flags,
                                 std::vector<std::byte> stored) {
  SectionEntry entry{id, Codec::kRaw, flags, 0, 0, stored.size(), 0};
  sections_.push_back({entry, std::move(stored)});
  return sections_.back();
}

std::vector<std::byte> CraftedFile::content(SectionKind kind) {
  const auto& s = section(kind);
  return unpack(s.entry.codec, s.stored, s.entry.rawBytes, "crafted");
}

void CraftedFile::setContent(SectionKind kind, std::vector<std::byte> raw) {
  auto& s = section(kind);
  s.entry.codec = Codec::kRaw;
  s.entry.rawBytes = raw.size();
  s.stored = std::move(raw);
}

std::vector<std::byte> CraftedFile::assemble() {
  table_ = {versionMajor, versionMinor, 0, kHeaderBytes, {}};
  std::uint64_t end = kHeaderBytes + sections_.size() * kEntryBytes;
  for (auto& s : sections_) {
    s.entry.offset = alignUp(end);
    s.entry.storedBytes = s.stored.size();
    s.entry.checksum = checksum(s.stored);
    end = s.entry.offset + s.entry.storedBytes;
    table_.entries.push_back(s.entry);
  }
  table_.fileBytes = end;
  return assembleAs(table_);
}

std::vector<std::byte> CraftedFile::assembleAs(const SectionTable& table) const {
  auto bytes = encodeTable(table);
  bytes.resize(std::max<std::size_t>(bytes.size(), table_.fileBytes));
  for (const auto& s : sections_)
    std::copy(s.stored.begin(), s.stored.end(), bytes.begin() + std::ptrdiff_t(s.entry.offset));
  return bytes;
}

}  // namespace esvr::test
