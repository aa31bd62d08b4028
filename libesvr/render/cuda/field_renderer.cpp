#include "render/cuda/field_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/cuda/use_device.h"
#include "esvr/error.h"
#include "render/cuda/make_cuda_renderer.h"
#include "render/ellipsoid_view.h"
#include "render/picture.h"

namespace esvr::cuda {
namespace {

constexpr int kSide = DrawTuning::kTileSide;
/// Kernels number lists and their entries with signed 32-bit integers.
constexpr std::int64_t kMaxLists = std::int64_t{1} << 30;

/// Adds spare room, so that lists that grow from view to view do not need new memory each time.
std::size_t withSpare(std::size_t n) { return n + n / 4 + 1024; }

template <class... Buffers>
std::size_t bytesOf(const Buffers&... buffers) {
  return (buffers.bytes() + ...);
}

/// \throws DeviceError  there are more ellipsoids than 32-bit integers can number
std::vector<PackedEllipsoid> numbered(std::vector<PackedEllipsoid> ellipsoids) {
  if (ellipsoids.size() > std::size_t(std::numeric_limits<std::int32_t>::max()))
    throw DeviceError("drawing on the GPU: " + std::to_string(ellipsoids.size()) +
                      " ellipsoids are more than 2^31");
  return ellipsoids;
}

int tilesAlong(int pixels) { return (pixels + kSide - 1) / kSide; }

}  // namespace

SceneMemory::SceneMemory(const Field& field, cudaStream_t stream)
    : ellipsoids(numbered(packed(field)), stream),
      origins(chunkOrigins(field), stream),
      kernels(rayKernels(field), stream),
      views(ellipsoids.size(), stream),
      footprints(ellipsoids.size(), stream),
      large(ellipsoids.size(), stream) {}

std::size_t SceneMemory::bytes() const {
  return bytesOf(ellipsoids, origins, kernels, views, footprints, large);
}

DeviceEllipsoids SceneMemory::view() const {
  return {ellipsoids.data(), std::uint32_t(ellipsoids.size()), origins.data(), kernels.data(),
          kernels.size() > 1 ? 1 : 0};
}

SeenEllipsoids SceneMemory::seen() { return {views.data(), footprints.data(), large.data()}; }

std::size_t BandMemory::bytes() const {
  return bytesOf(counters, counts, ends, entries, sorted, items, partsOfTile, partsDone, closedAt,
                 resultOf, results, pixels);
}

TileLists BandMemory::lists() {
  return {.counters = counters.data(),
          .counts = counts.data(),
          .ends = ends.data(),
          .entries = entries.data(),
          .sorted = sorted.data(),
          .entryCapacity = entries.size(),
          .sortedCapacity = sorted.size(),
          .items = items.data(),
          .partsOfTile = partsOfTile.data(),
          .partsDone = partsDone.data(),
          .closedAt = closedAt.data(),
          .resultOf = resultOf.data(),
          .results = results.data(),
          .resultCapacity = results.size() / DrawTuning::kTilePixels};
}

/// The checked options of a picture, and values that are computed from them.
struct FieldRenderer::Scene {
  Scene(const RenderOptions& o, const PlaceBox& box)
      : options(o), view((checkRenderOptions(o), viewOf(o, box))) {
    refuseShading(o);
  }

  const RenderOptions& options;
  View view;
  BinRange bins{0, -1};
};

FieldRenderer::FieldRenderer(const Field& field, const Device& device, const RendererLimits& limits,
                             const RevoxeliseOptions& voxels)
    : field_(field),
      limits_(limits),
      voxelRule_(makeVoxelRule(field.background, voxels)),
      box_(supportBox(field)),
      stream_(streamOn(device)),
      multiprocessors_(multiprocessorsOf(device)),
      scene_(field, stream_.get()),
      parts_(limits.depthParts) {}

Image FieldRenderer::draw(const RenderOptions& options) {
  Image image{options.resolution.width, options.resolution.height, {}};
  drawFrame(options, &image);
  return image;
}

void FieldRenderer::drawOnDevice(const RenderOptions& options) { drawFrame(options, nullptr); }

void FieldRenderer::drawFrame(const RenderOptions& options, Image* image) {
  Scene scene(options, box_.value_or(kNoPlaces));
  if (image != nullptr)
    image->rgba.assign(std::size_t(4) * std::size_t(image->width) * std::size_t(image->height),
                       0.0f);
  stats_ = {.deviceBytes = stats_.deviceBytes};
  tiles_ = occupied_ = 0;
  if (box_) scene.bins = binsWithin(*box_, scene.view, options.step);
  if (scene.bins.last < scene.bins.first) return;
  checkRayLength(scene.bins);
  table_.update(options.transfer, samplingOf(options), stream_.get());
  drawBand(scene, {0, tilesAlong(options.resolution.height)}, image);
}

TileFrame FieldRenderer::frameOf(const Scene& scene, Band band) const {
  const Resolution resolution = scene.options.resolution;
  const int columns = tilesAlong(resolution.width);
  const std::int64_t bins = scene.bins.last - scene.bins.first + 1;
  if (bins > kMaxLists / columns)
    throw UsageError("rays of " + std::to_string(bins * kBinSamples) +
                     " samples are too long for so wide a picture; take a longer step");
  // The depth at which a ray stops depends on all samples before it, so there are no parts.
  const bool whole = scene.options.mode == RenderMode::kDepth;
  const int parts = whole ? 1 : std::clamp(parts_, 1, int(bins));
  return {.view = scene.view,
          .resolution = resolution,
          .step = scene.options.step,
          .tileColumns = columns,
          .firstTileRow = band.first,
          .tileRows = band.count,
          .firstBin = scene.bins.first,
          .bins = int(bins),
          .parts = parts,
          .binsOfPart = (int(bins) + parts - 1) / parts};
}

/// Bytes of the buffers that reserve() makes. Entries of lists and results of parts are not
/// included, because their number is known only after counting.
std::size_t FieldRenderer::bandBytes(const TileFrame& f) const {
  const std::size_t tiles = std::size_t(f.tiles());
  const std::size_t ofParts =
      std::size_t(f.parts) *
      (DrawTuning::kLengthClasses * sizeof(TilePart) + sizeof(std::uint32_t));
  const std::size_t ofLists = std::size_t(f.bins) * 2 * sizeof(std::uint32_t);
  return tiles *
         (ofParts + ofLists + 3 * sizeof(std::uint32_t) + DrawTuning::kTilePixels * sizeof(float4));
}

void FieldRenderer::reserve(const TileFrame& f) {
  const cudaStream_t stream = stream_.get();
  const std::size_t tiles = std::size_t(f.tiles()), lists = tiles * std::size_t(f.bins);
  const std::size_t parts = tiles * std::size_t(f.parts);
  const int rows = std::min(f.tileRows * kSide, f.resolution.height - f.firstTileRow * kSide);
  makeRoom(band_.counters, 1, stream);
  makeRoom(band_.counts, lists, stream);
  makeRoom(band_.ends, lists, stream);
  makeRoom(band_.items, parts * DrawTuning::kLengthClasses, stream);
  for (auto* ofTile : {&band_.partsOfTile, &band_.partsDone, &band_.closedAt})
    makeRoom(*ofTile, tiles, stream);
  makeRoom(band_.resultOf, parts, stream);
  makeRoom(band_.pixels, std::size_t(rows) * std::size_t(f.resolution.width), stream);
}

/// Clears the counters, projects the ellipsoids, counts their list entries and plans the work.
void FieldRenderer::list(const TileFrame& f) {
  const cudaStream_t stream = stream_.get();
  band_.counters.setZero();
  check(
      cudaMemsetAsync(band_.counts.data(), 0,
                      std::size_t(f.tiles()) * std::size_t(f.bins) * sizeof(std::uint32_t), stream),
      "clearing counts");
  launchView(f, scene_.view(), scene_.seen(), band_.lists(), multiprocessors_, stream);
  launchPlan(f, band_.lists(), stream);
}

FrameCounters FieldRenderer::readCounters() {
  FrameCounters counters{};
  band_.counters.download(std::span<FrameCounters>(&counters, 1));
  return counters;
}

/// Number of parts into which the depth of tiles is divided. It is large enough that no tile has
/// much more work in one part than the average block has.
int FieldRenderer::chosenParts(const TileFrame& f) {
  list(f);
  const FrameCounters c = readCounters();
  if (c.entries == 0) return 1;
  const double blocks = double(multiprocessors_) * DrawTuning::kBlocksPerMultiprocessor;
  const double share = double(c.entries) / blocks;
  return int(std::clamp(std::ceil(double(c.longestTile) / (2.0 * share)), 1.0,
                        double(RendererLimits::kMaxDepthParts)));
}

FrameCounters FieldRenderer::drawOnce(const Scene& scene, const TileFrame& f) {
  const cudaStream_t stream = stream_.get();
  begin_.record(stream);
  list(f);
  launchFill(f, std::uint32_t(scene_.ellipsoids.size()), scene_.seen(), band_.lists(),
             multiprocessors_, stream);
  listed_.record(stream);
  band_.pixels.setZero();
  launchDrawSums({.draw = {.frame = f,
                           .lists = band_.lists(),
                           .rule = sampleRule(scene.options, table_.view(), field_.background),
                           .voxelRule = voxelRule_,
                           .clip = clipOf(scene.options),
                           .pixels = band_.pixels.data()},
                  .views = scene_.views.data(),
                  .footprints = scene_.footprints.data()},
                 multiprocessors_, stream);
  drawn_.record(stream);
  return readCounters();
}

void FieldRenderer::grow(const FrameCounters& c) {
  if (c.entries > std::uint64_t(kMaxLists))
    throw DeviceError("drawing on the GPU: " + std::to_string(c.entries) +
                      " entries are more than the lists of ellipsoids can hold");
  const cudaStream_t stream = stream_.get();
  if (c.entries > band_.entries.size()) makeRoom(band_.entries, withSpare(c.entries), stream);
  if (needSorting(c)) makeRoom(band_.sorted, band_.entries.size(), stream);
  if (std::uint64_t(c.results) * DrawTuning::kTilePixels > band_.results.size())
    makeRoom(band_.results, std::size_t(c.results + c.results / 4) * DrawTuning::kTilePixels,
             stream);
}

void FieldRenderer::drawBand(const Scene& scene, Band band, Image* image) {
  checkCancelled(scene.options);
  TileFrame f = frameOf(scene, band);
  const bool tooMany = std::int64_t(f.tiles()) * f.bins > kMaxLists;
  const auto tooLarge = [&](std::size_t bytes) {
    return limits_.maxBytes != 0 && bytes > limits_.maxBytes;
  };
  const auto halves = [&] {
    if (band.count == 1)
      throw DeviceError("drawing on the GPU needs more than " + std::to_string(limits_.maxBytes) +
                        " bytes; allow more memory or draw a smaller picture");
    band_ = {};
    drawBand(scene, {band.first, band.count / 2}, image);
    drawBand(scene, {band.first + band.count / 2, band.count - band.count / 2}, image);
  };
  if (tooMany || tooLarge(fixedBytes() + bandBytes(f))) return halves();
  reserve(f);
  if (parts_ == 0) {
    parts_ = chosenParts(f);
    f = frameOf(scene, band);
    reserve(f);
  }
  FrameCounters counters = drawOnce(scene, f);
  while (!listsFit(counters, band_.lists())) {
    grow(counters);
    if (tooLarge(fixedBytes() + band_.bytes())) return halves();
    counters = drawOnce(scene, f);
  }
  count(f, counters);
  if (image != nullptr) download(f, *image);
}

void FieldRenderer::count(const TileFrame& f, const FrameCounters& c) {
  tiles_ += std::uint64_t(f.tiles()), occupied_ += c.occupiedTiles;
  stats_.listMs += listed_.millisecondsSince(begin_);
  stats_.drawMs += drawn_.millisecondsSince(listed_);
  stats_.listEntries += c.entries;
  stats_.occupancy = double(occupied_) / double(tiles_);
  stats_.depthParts = f.parts;
  stats_.deviceBytes = std::max<std::uint64_t>(stats_.deviceBytes, fixedBytes() + band_.bytes());
}

void FieldRenderer::download(const TileFrame& f, Image& image) {
  const int firstRow = f.firstTileRow * kSide;
  const int rows = std::min(f.tileRows * kSide, f.resolution.height - firstRow);
  const std::size_t width = std::size_t(f.resolution.width);
  check(cudaMemcpyAsync(&image.rgba[4 * width * std::size_t(firstRow)], band_.pixels.data(),
                        width * std::size_t(rows) * sizeof(float4), cudaMemcpyDeviceToHost,
                        stream_.get()),
        "copying a picture from the device");
  stream_.synchronize();
}

std::unique_ptr<Renderer> makeCudaFieldRenderer(const Field& field, const Device& device,
                                                const RendererLimits& limits,
                                                const RevoxeliseOptions& voxels) {
  return std::make_unique<FieldRenderer>(field, device, limits, voxels);
}

}  // namespace esvr::cuda
