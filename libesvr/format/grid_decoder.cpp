#include "format/grid_decoder.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "esvr/error.h"
#include "format/bricks_stream.h"
#include "format/chunk_box.h"
#include "format/curve_stream.h"
#include "format/ellipsoids_section.h"
#include "format/grid_record.h"
#include "format/layer_errors_stream.h"
#include "format/layered_section.h"
#include "format/level_section.h"
#include "format/mask_section.h"
#include "format/planes.h"
#include "format/related_voxels.h"
#include "format/validity.h"
#include "format/voxel_section.h"

namespace esvr::format {
namespace {

bool meet(const Box& a, const Box& b) {
  const Coord low = maxCoord(a.min, b.min), high = minCoord(a.max, b.max);
  return low.x <= high.x && low.y <= high.y && low.z <= high.z;
}

bool encloses(const Box& outer, const Box& inner) {
  return inner.empty() || (outer.contains(inner.min) && outer.contains(inner.max));
}

/// A chunk whose section of layered ellipsoids is open.
struct OpenChunk {
  std::unique_ptr<ByteSource> section;  ///< null: the chunk has no layers, or is not wanted
  BlockDirectory directory;
};

/// Reads one grid of a file.
class GridDecoder {
 public:
  GridDecoder(const GridsOfFile& file, std::uint32_t grid)
      : sections_(file.sections), records_(file.records), g_(grid), part_(file.part) {}

  DecodedGrid decodeRecord() { return readRecords(); }

  DecodedGrid decode(std::span<const StoredGrid> before) {
    DecodedGrid decoded = readRecords();
    StoredGrid& grid = decoded.grid;
    readChunks(grid);
    if (grid.topology == TopologyKind::kBricks) readBricks(grid);
    if (grid.topology == TopologyKind::kMask) readMask(grid);
    if (grid.topology == TopologyKind::kBlocks) readLevels(grid);
    readVoxels(grid);
    readRelated(before, grid);
    readResidual(grid);
    readLayerErrors(grid);
    readCurve(grid);
    return decoded;
  }

 private:
  [[nodiscard]] SectionId id(SectionKind kind, std::uint32_t chunk = kNone) const {
    return {kind, g_, chunk};
  }

  void refuse(const std::optional<Fault>& fault, std::uint32_t chunk = kNone) const {
    if (!fault) return;
    SectionId place = id(fault->section, chunk);
    for (const auto kind : {SectionKind::kEllipsoids, SectionKind::kLayered})
      if (wasThere(id(kind, chunk))) place = id(kind, chunk);
    throw BadInput(sections_.place(place) + ": " + fault->text);
  }

  [[nodiscard]] bool wasThere(const SectionId& section) const {
    const auto& entries = sections_.table().entries;
    return std::any_of(entries.begin(), entries.end(),
                       [&](const auto& entry) { return entry.id == section; });
  }

  GridRecord readRecord() {
    const auto content = records_.take(g_);
    ByteReader in(content, records_.place(g_));
    GridRecord record = getGrid(in);
    in.finish();
    refuse(faultOf(record.grid));
    return record;
  }

  /// The record of the grid, with those of its chunks.
  DecodedGrid readRecords() {
    GridRecord record = readRecord();
    chunks_ = record.chunkCount > 1 ? readChunkTable(record.chunkCount) : std::move(record.chunks);
    DecodedGrid decoded{std::move(record.grid)};
    for (const ChunkRecord& chunk : chunks_) decoded.ellipsoidsInFile += chunk.count;
    return decoded;
  }

  std::vector<ChunkRecord> readChunkTable(std::uint32_t count) {
    const auto content = sections_.get(id(SectionKind::kChunks));
    ByteReader in(content, sections_.place(id(SectionKind::kChunks)));
    if (content.size() != count * kChunkRecordBytes)
      in.fail("not a table of " + std::to_string(count) + " chunks");
    std::vector<ChunkRecord> records;
    for (std::uint32_t c = 0; c < count; ++c) records.push_back(getChunk(in));
    return records;
  }

  void readPlanes(const SectionId& section, std::uint64_t count, std::span<Plane> planes) {
    getPlanes(sections_.get(section), count, planes, sections_.place(section));
  }

  /// True if the grid's ellipsoids are quantised. Its chunks are then all quantised, except for
  /// those without ellipsoids.
  [[nodiscard]] bool anyQuantised() const {
    for (std::uint32_t c = 0; c < chunks_.size(); ++c)
      for (const auto kind : {SectionKind::kEllipsoids, SectionKind::kLayered})
        if (sections_.has(id(kind, c))) return true;
    return false;
  }

  [[nodiscard]] bool wanted(const Box& box) const {
    return !part_ || !part_->box || meet(box, *part_->box);
  }

  void readChunks(StoredGrid& grid) {
    if (anyQuantised()) grid.quantised.resize(chunks_.size());
    std::vector<OpenChunk> open;
    for (std::uint32_t c = 0; c < chunks_.size(); ++c) open.push_back(openChunk(c, chunks_[c]));
    layers_ = layersWanted(open);
    for (std::uint32_t c = 0; c < chunks_.size(); ++c)
      grid.field.chunks.push_back(open[c].section ? readLayered(c, chunks_[c], open[c], grid)
                                                  : readChunk(c, chunks_[c], grid));
  }

  OpenChunk openChunk(std::uint32_t c, const ChunkRecord& record) {
    const auto section = id(SectionKind::kLayered, c);
    layersInFile_ = std::max<std::size_t>(layersInFile_, record.count > 0 ? 1 : 0);
    if (record.count == 0 || !wanted(record.box) || !sections_.has(section)) return {};
    OpenChunk open{sections_.open(section, part_ == nullptr), {}};
    open.directory = getDirectory(*open.section, record);
    layersInFile_ = std::max(layersInFile_, open.directory.layerEnds.size());
    if (!part_) checkEnd(*open.section, open.directory);
    return open;
  }

  /// Number of layers to read of each chunk.
  [[nodiscard]] std::size_t layersWanted(const std::vector<OpenChunk>& open) const {
    const std::size_t maxLayers = part_ && part_->layers ? *part_->layers : kAllLayers;
    if (!part_ || !part_->ellipsoids) return maxLayers;
    std::vector<std::uint64_t> sizes;
    for (std::size_t c = 0; c < open.size(); ++c) addLayerSizes(chunks_[c], open[c], sizes);
    std::uint64_t sum = 0;
    for (std::size_t layer = 0; layer < sizes.size(); ++layer)
      if ((sum += sizes[layer]) >= *part_->ellipsoids) return std::min(maxLayers, layer + 1);
    return maxLayers;
  }

  void addLayerSizes(const ChunkRecord& record, const OpenChunk& open,
                     std::vector<std::uint64_t>& sizes) const {
    std::vector<std::size_t> ends = open.directory.layerEnds;
    if (ends.empty()) ends.push_back(wanted(record.box) ? record.count : 0);
    sizes.resize(std::max(sizes.size(), ends.size()));
    std::size_t first = 0;
    for (std::size_t k = 0; k < ends.size(); ++k) {
      sizes[k] += ends[k] - first;
      first = ends[k];
    }
  }

  Chunk readLayered(std::uint32_t c, const ChunkRecord& record, const OpenChunk& open,
                    StoredGrid& grid) {
    const auto& blocks = open.directory.blocks;
    std::vector<std::size_t> chosen;
    for (std::size_t b = 0; b < blocks.size(); ++b)
      if (blocks[b].layer < layers_ && wanted(blocks[b].box)) chosen.push_back(b);
    for (const std::size_t b : chosen)
      sections_.budget().take(double(blocks[b].run.count) * kDecodedBytesPerEllipsoid,
                              open.section->name());
    grid.quantised[c] = getBlocks(*open.section, open.directory, chosen);
    Chunk chunk{record.origin, dequantise(grid.quantised[c])};
    refuse(faultOf(chunk.ellipsoids), c);
    std::size_t first = 0;
    for (const std::size_t b : chosen) {
      const Run run{first, blocks[b].run.count};
      if (!encloses(blocks[b].box, centerBox(chunk, run)))
        refuse(Fault{SectionKind::kLayered, "a center lies outside its block's box"}, c);
      first += run.count;
    }
    return chunk;
  }

  Chunk readChunk(std::uint32_t c, const ChunkRecord& record, StoredGrid& grid) {
    Chunk chunk{record.origin, {}};
    if (record.count == 0 || !wanted(record.box)) return chunk;
    if (grid.quantised.empty())
      chunk.ellipsoids = readEllipsoids(c, record.count);
    else
      chunk.ellipsoids = readQuantised(c, record.count, grid.quantised[c]);
    refuse(faultOf(chunk.ellipsoids), c);
    if (!encloses(record.box, centerBox(chunk, all(chunk))))
      refuse(Fault{SectionKind::kCenters, "a center lies outside the chunk's box"}, c);
    return chunk;
  }

  Ellipsoids readEllipsoids(std::uint32_t c, std::uint64_t count) {
    Ellipsoids e;
    readPlanes(id(SectionKind::kCenters, c), count, e.center);
    readPlanes(id(SectionKind::kScales, c), count, e.logScale);
    if (const auto section = id(SectionKind::kRotations, c); sections_.has(section))
      readPlanes(section, count, e.rotation);
    else
      setIdentity(e.rotation, count);
    readPlanes(id(SectionKind::kIntensities, c), count, {&e.intensity, 1});
    if (const auto section = id(SectionKind::kKappas, c); sections_.has(section))
      readPlanes(section, count, {&e.kappa, 1});
    return e;
  }

  Ellipsoids readQuantised(std::uint32_t c, std::uint64_t count, QuantisedEllipsoids& quantised) {
    const auto section = id(SectionKind::kEllipsoids, c);
    const auto content = sections_.get(section);
    const auto held = std::min(count, kMaxEllipsoidsPerByte * content.size());
    sections_.budget().take(double(held) * kDecodedBytesPerEllipsoid, sections_.place(section));
    quantised = getEllipsoids(content, count, sections_.place(section));
    return dequantise(quantised);
  }

  void readBricks(StoredGrid& grid) {
    const auto section = id(SectionKind::kBricks);
    if (sections_.has(section))
      grid.bricks = getBricks(sections_.get(section), sections_.place(section));
  }

  void readMask(StoredGrid& grid) {
    const auto section = id(SectionKind::kMask);
    Mask mask = getMask(sections_.get(section), sections_.place(section), sections_.budget());
    grid.bricks = std::move(mask.bricks);
    grid.mask = std::move(mask.active);
  }

  void readLevels(StoredGrid& grid) {
    const auto section = id(SectionKind::kLevels);
    Levels levels = getLevels(sections_.get(section), sections_.place(section), sections_.budget());
    grid.bricks = std::move(levels.bricks);
    grid.levels = std::move(levels.levels);
  }

  void readVoxels(StoredGrid& grid) {
    const auto section = id(SectionKind::kVoxels);
    if (sections_.has(section))
      grid.voxels = getVoxels(sections_.get(section), sections_.place(section), sections_.budget());
  }

  void readRelated(std::span<const StoredGrid> before, StoredGrid& grid) {
    const auto section = id(SectionKind::kRelated);
    if (!sections_.has(section)) return;
    if (grid.voxels) throw BadInput(sections_.place(section) + ": the grid has two sets of voxels");
    getRelated(sections_.get(section), sections_.place(section), before, sections_.budget(), grid);
  }

  /// Reads the residual, unless only some of the layers are read: it corrects the sum of all
  /// layers.
  void readResidual(StoredGrid& grid) {
    const auto section = id(SectionKind::kResidual);
    if (!sections_.has(section) || layers_ != kAllLayers) return;
    grid.residual = getVoxels(sections_.get(section), sections_.place(section), sections_.budget());
    refuse(residualFaultOf(grid));
  }

  /// Reads the errors of the layers that were read. They hold for whole grids only, not for a box.
  void readLayerErrors(StoredGrid& grid) {
    const auto section = id(SectionKind::kLayerErrors);
    if (!sections_.has(section) || (part_ && part_->box)) return;
    grid.layerErrors =
        getLayerErrors(sections_.get(section), layersInFile_, sections_.place(section));
    grid.layerErrors.resize(layerCount(grid));
  }

  void readCurve(StoredGrid& grid) {
    const auto section = id(SectionKind::kCurve);
    if (sections_.has(section) && !part_)
      grid.curve = getCurve(sections_.get(section), sections_.place(section));
  }

  static constexpr std::size_t kAllLayers = std::numeric_limits<std::size_t>::max();

  SectionReader& sections_;
  GridRecords& records_;
  std::uint32_t g_;
  const ReadPart* part_;
  std::vector<ChunkRecord> chunks_;
  std::size_t layers_ = kAllLayers;  ///< number of layers to read
  std::size_t layersInFile_ = 0;     ///< largest number of layers of a chunk that was opened
};

}  // namespace

DecodedGrid decodeGrid(const GridsOfFile& file, std::uint32_t grid,
                       std::span<const StoredGrid> before) {
  return GridDecoder(file, grid).decode(before);
}

DecodedGrid decodeGridRecord(const GridsOfFile& file, std::uint32_t grid) {
  return GridDecoder(file, grid).decodeRecord();
}

}  // namespace esvr::format
