#include "format/sample_files.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <random>

#include "format/morton_order.h"

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

std::string difference(const Ellipsoids& a, const Ellipsoids& b) {
  if (!sameBits(a.center, b.center)) return "centers";
  if (!sameBits(a.logScale, b.logScale)) return "scales";
  if (!sameBits(a.rotation, b.rotation)) return "rotations";
  if (!sameBits(a.intensity, b.intensity)) return "intensities";
  if (!sameBits(a.kappa, b.kappa)) return "kappas";
  return "";
}

std::string difference(const Field& a, const Field& b) {
  if (!sameBits(a.background, b.background)) return "background of the field";
  if (!(a.kernel == b.kernel)) return "kernel";
  if (a.chunks.size() != b.chunks.size()) return "number of chunks";
  for (std::size_t c = 0; c < a.chunks.size(); ++c) {
    if (a.chunks[c].origin != b.chunks[c].origin) return "origin of a chunk";
    const auto text = difference(a.chunks[c].ellipsoids, b.chunks[c].ellipsoids);
    if (!text.empty()) return text;
  }
  return "";
}

std::string difference(const StoredGrid& a, const StoredGrid& b) {
  if (!(a.descriptor == b.descriptor)) return "descriptor";
  if (!sameBits(a.descriptor.background, b.descriptor.background)) return "background";
  if (a.topology != b.topology || a.bricks != b.bricks || a.mask != b.mask || a.levels != b.levels)
    return "topology";
  if (!sameBits(a.activeThreshold, b.activeThreshold)) return "threshold";
  if (a.withinRange != b.withinRange) return "withinRange";
  if (!(a.activeBox == b.activeBox) || a.activeVoxels != b.activeVoxels) return "active voxels";
  if (!sameBits(a.valueMin, b.valueMin) || !sameBits(a.valueMax, b.valueMax)) return "value range";
  if (a.curve != b.curve) return "curve";
  if (a.voxels != b.voxels) return "voxels";
  if (a.residual != b.residual) return "residual";
  if (a.quantised != b.quantised) return "quantised";
  if (a.layerErrors != b.layerErrors) return "errors of layers";
  return difference(a.field, b.field);
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

StoredGrid quantisedGrid(std::size_t ellipsoidsPerChunk, bool layered) {
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
  return quantisedGrid(ellipsoidsPerChunk, false);
}

StoredGrid layeredGrid(std::size_t ellipsoidsPerChunk) {
  StoredGrid grid = quantisedGrid(ellipsoidsPerChunk, true);
  for (std::size_t k = 0; layerCount(grid) > 1 && k < layerCount(grid); ++k)
    grid.layerErrors.push_back({20.0f + 5.0f * float(k), 1.0f / float(1 + k)});
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

std::vector<std::byte> bytesOf(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::string difference(const EsvrFile& a, const EsvrFile& b) {
  if (a.metadata != b.metadata) return "metadata";
  if (a.grids.size() != b.grids.size()) return "number of grids";
  for (std::size_t g = 0; g < a.grids.size(); ++g) {
    const auto text = difference(a.grids[g], b.grids[g]);
    if (!text.empty()) return "grid " + std::to_string(g) + ": " + text;
  }
  if (a.carried != b.carried) return "carried grids";
  if (a.vectors != b.vectors) return "vectors";
  return "";
}

}  // namespace esvr::test
