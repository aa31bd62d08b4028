#include "format/decode.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "esvr/error.h"
#include "format/bricks_stream.h"
#include "format/carried_record.h"
#include "format/chunk_box.h"
#include "format/continued_grid.h"
#include "format/curve_stream.h"
#include "format/ellipsoids_section.h"
#include "format/frame_table.h"
#include "format/grid_record.h"
#include "format/grid_records.h"
#include "format/layer_errors_stream.h"
#include "format/layered_section.h"
#include "format/level_section.h"
#include "format/mask_section.h"
#include "format/planes.h"
#include "format/predicted_grid.h"
#include "format/related_voxels.h"
#include "format/section_reader.h"
#include "format/validity.h"
#include "format/voxel_section.h"

namespace esvr {
namespace {

using namespace format;

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

/// The file that grids are read from.
struct GridsOfFile {
  SectionReader& sections;
  GridRecords& records;
  const ReadPart* part = nullptr;  ///< the part to read; null: all of it
};

/// Reads one grid of a file.
class GridDecoder {
 public:
  GridDecoder(const GridsOfFile& file, std::uint32_t grid)
      : sections_(file.sections), records_(file.records), g_(grid), part_(file.part) {}

  /// The record alone.
  StoredGrid decodeRecord() { return readRecords().grid; }

  /// Number of the grid's ellipsoids in the file, once its record was read.
  [[nodiscard]] std::uint64_t ellipsoidsInFile() const { return ellipsoidsInFile_; }

  /// \param before  the grids before this one
  StoredGrid decode(std::span<const StoredGrid> before) {
    GridRecord record = readRecords();
    StoredGrid grid = std::move(record.grid);
    readChunks(record.chunks, grid);
    if (grid.topology == TopologyKind::kBricks) readBricks(grid);
    if (grid.topology == TopologyKind::kMask) readMask(grid);
    if (grid.topology == TopologyKind::kBlocks) readLevels(grid);
    readVoxels(grid);
    readRelated(before, grid);
    readResidual(grid);
    readLayerErrors(grid);
    readCurve(grid);
    return grid;
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
  GridRecord readRecords() {
    GridRecord record = readRecord();
    if (record.chunkCount > 1) record.chunks = readChunkTable(record.chunkCount);
    for (const ChunkRecord& chunk : record.chunks) ellipsoidsInFile_ += chunk.count;
    return record;
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
  [[nodiscard]] bool anyQuantised(std::size_t chunks) const {
    for (std::uint32_t c = 0; c < chunks; ++c)
      for (const auto kind : {SectionKind::kEllipsoids, SectionKind::kLayered})
        if (sections_.has(id(kind, c))) return true;
    return false;
  }

  [[nodiscard]] bool wanted(const Box& box) const {
    return !part_ || !part_->box || meet(box, *part_->box);
  }

  void readChunks(const std::vector<ChunkRecord>& records, StoredGrid& grid) {
    if (anyQuantised(records.size())) grid.quantised.resize(records.size());
    std::vector<OpenChunk> open;
    for (std::uint32_t c = 0; c < records.size(); ++c) open.push_back(openChunk(c, records[c]));
    layers_ = layersWanted(records, open);
    for (std::uint32_t c = 0; c < records.size(); ++c)
      grid.field.chunks.push_back(open[c].section ? readLayered(c, records[c], open[c], grid)
                                                  : readChunk(c, records[c], grid));
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
  [[nodiscard]] std::size_t layersWanted(const std::vector<ChunkRecord>& records,
                                         const std::vector<OpenChunk>& open) const {
    const std::size_t maxLayers = part_ && part_->layers ? *part_->layers : kAllLayers;
    if (!part_ || !part_->ellipsoids) return maxLayers;
    std::vector<std::uint64_t> sizes;
    for (std::size_t c = 0; c < open.size(); ++c) addLayerSizes(records[c], open[c], sizes);
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
    Levels levels =
        getLevels(sections_.get(section), sections_.place(section), {}, sections_.budget());
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
  std::size_t layers_ = kAllLayers;  ///< number of layers to read
  std::uint64_t ellipsoidsInFile_ = 0;
  std::size_t layersInFile_ = 0;  ///< largest number of layers of a chunk that was opened
};

std::vector<MetaItem> readFileMetadata(SectionReader& sections) {
  const SectionId section{SectionKind::kFileMetadata};
  if (!sections.has(section)) return {};
  const auto content = sections.get(section);
  ByteReader in(content, sections.place(section));
  auto items = getMetadata(in);
  in.finish();
  return items;
}

}  // namespace

namespace format {
namespace {

/// What is read of the bytes of carried grids.
enum class CarriedBytes { kNothing, kChecked, kAll };

CarriedGrid readCarriedGrid(SectionReader& sections, std::uint32_t number, CarriedBytes bytes) {
  const SectionId record{SectionKind::kCarried, number};
  const auto content = sections.get(record);
  ByteReader in(content, sections.place(record));
  CarriedGrid grid = getCarried(in);
  in.finish();
  const SectionId stored{SectionKind::kCarriedBytes, number};
  if (bytes == CarriedBytes::kAll) grid.bytes = sections.getLarge(stored);
  if (bytes == CarriedBytes::kChecked) sections.check(stored);
  return grid;
}

void readCarriedGrids(SectionReader& sections, CarriedBytes bytes, EsvrFile& file) {
  const std::uint32_t count = sections.count(SectionKind::kCarried);
  for (std::uint32_t c = 0; c < count; ++c)
    file.carried.push_back(readCarriedGrid(sections, std::uint32_t(file.grids.size()) + c, bytes));
}

void readVectors(SectionReader& sections, EsvrFile& file) {
  for (std::uint32_t g = 0; g < file.grids.size(); ++g) {
    const SectionId section{SectionKind::kVector, g};
    if (!sections.has(section)) continue;
    const auto content = sections.get(section);
    ByteReader in(content, sections.place(section));
    file.vectors.push_back({in.getString(), g});
    in.finish();
  }
}

/// Checks that carried grids and vectors have possible places.
void checkOrder(const SectionReader& sections, const EsvrFile& file) try {
  (void)gridsInOrder(file);
  for (const StoredVector& vector : file.vectors)
    if (const auto fault = faultOf(componentsOf(file, vector)))
      throw BadInput(sections.place({fault->section, std::uint32_t(vector.first)}) + ": " +
                     fault->text);
} catch (const RuntimeFailure& fault) {
  const bool carried = !file.carried.empty();
  const SectionId place{carried ? SectionKind::kCarried : SectionKind::kVector,
                        std::uint32_t(carried ? file.grids.size() : file.vectors.front().first)};
  throw BadInput(sections.place(place) + ": " + fault.what());
}

/// The kind of the section of a grid that refers to the grid of the same number in the previous
/// frame; nothing if the grid does not.
std::optional<SectionKind> kindAfter(const SectionReader& sections, std::uint32_t g) {
  for (const auto kind : {SectionKind::kPredicted, SectionKind::kContinued})
    if (sections.has({kind, g})) return kind;
  return std::nullopt;
}

StoredGrid readAfter(SectionReader& sections, const SectionId& section, const EsvrFile& previous) {
  const std::string where = sections.place(section);
  if (section.grid >= previous.grids.size())
    throw BadInput(where + ": the frame before has only " + std::to_string(previous.grids.size()) +
                   " grids");
  const auto get = section.kind == SectionKind::kPredicted ? getPredicted : getContinuedGrid;
  StoredGrid grid =
      get(sections.get(section), where, previous.grids[section.grid], sections.budget());
  if (const auto fault = faultOf(grid)) throw BadInput(where + ": " + fault->text);
  return grid;
}

/// For each grid: whether it is wanted, or a wanted grid refers to it.
std::vector<bool> neededGrids(const SectionReader& sections, std::size_t count,
                              const ReadPart* part) {
  std::vector<bool> needed(count, !part || !part->grids);
  if (!part || !part->grids) return needed;
  for (const std::size_t g : *part->grids)
    if (g < count) needed[g] = true;
  for (std::size_t g = count; g-- > 0;) {
    const SectionId related{SectionKind::kRelated, std::uint32_t(g)};
    if (!needed[g] || !sections.has(related)) continue;
    const auto reference =
        referenceIn(sections.peek(related, kReferenceBytes), sections.place(related));
    if (reference && *reference < g) needed[*reference] = true;
  }
  return needed;
}

/// Reads the grids of a file that stands alone, and its layout.
/// \return for each grid, the number of its ellipsoids in the file
std::vector<std::uint64_t> readGrids(SectionReader& sections, const ReadPart* part,
                                     EsvrFile& file) {
  if (sections.count(SectionKind::kGridRecords) + sections.count(SectionKind::kPacked) > 0)
    file.layout = FileLayout::kCompact;
  GridRecords records(sections);
  const auto needed = neededGrids(sections, records.count(), part);
  std::vector<std::uint64_t> ellipsoids;
  for (std::uint32_t g = 0; g < needed.size(); ++g) {
    GridDecoder decoder({sections, records, part}, g);
    file.grids.push_back(needed[g] ? decoder.decode(file.grids) : decoder.decodeRecord());
    ellipsoids.push_back(decoder.ellipsoidsInFile());
  }
  return ellipsoids;
}

/// Reads the grids of a frame that refers to the previous one, and its layout.
void readGridsAfter(SectionReader& sections, const EsvrFile& previous, EsvrFile& file) {
  if (sections.has({SectionKind::kGridRecords})) file.layout = FileLayout::kCompact;
  GridRecords records(sections);
  const std::uint32_t count = records.count() + sections.count(SectionKind::kPredicted) +
                              sections.count(SectionKind::kContinued);
  for (std::uint32_t g = 0; g < count; ++g)
    if (const auto kind = kindAfter(sections, g))
      file.grids.push_back(readAfter(sections, {*kind, g}, previous));
    else
      file.grids.push_back(GridDecoder({sections, records}, g).decode(file.grids));
}

CarriedBytes carriedBytesOf(const ReadLimits& limits) {
  return limits.carriedBytes ? CarriedBytes::kAll : CarriedBytes::kChecked;
}

}  // namespace

EsvrFile decode(const ByteSource& source, const ReadLimits& limits) {
  SectionReader sections(source, limits);
  EsvrFile file{readFileMetadata(sections), {}};
  readGrids(sections, nullptr, file);
  readCarriedGrids(sections, carriedBytesOf(limits), file);
  readVectors(sections, file);
  checkOrder(sections, file);
  sections.finish();
  return file;
}

EsvrFile decodeShort(std::span<const std::byte> bytes, const std::string& name,
                     const ReadLimits& limits, const EsvrFile& previous) {
  const MemorySource source(bytes, name);
  FrameTable table = getFrame(bytes, name);
  SectionReader sections(source, std::move(table.sections), limits);
  EsvrFile file{readFileMetadata(sections), {}};
  readGridsAfter(sections, previous, file);
  readCarriedGrids(sections, carriedBytesOf(limits), file);
  readVectors(sections, file);
  if (table.inherited.metadata) file.metadata = previous.metadata;
  if (table.inherited.carried) file.carried = previous.carried;
  if (table.inherited.vectors) file.vectors = previous.vectors;
  checkOrder(sections, file);
  sections.finish();
  return file;
}

PartOfFile decodePart(const ByteSource& source, const ReadPart& part) {
  SectionReader sections(source, part.limits);
  PartOfFile result;
  EsvrFile& file = result.file;
  file.metadata = readFileMetadata(sections);
  result.ellipsoidsInFile = readGrids(sections, &part, file);
  readCarriedGrids(sections, part.carriedBytes ? CarriedBytes::kAll : CarriedBytes::kNothing, file);
  readVectors(sections, file);
  checkOrder(sections, file);
  result.bytesRead = source.bytesRead();
  return result;
}

}  // namespace format

EsvrFile decodeEsvr(std::span<const std::byte> bytes, const std::string& nameForErrors,
                    const ReadLimits& limits) {
  return format::decode(format::MemorySource(bytes, nameForErrors), limits);
}

}  // namespace esvr
