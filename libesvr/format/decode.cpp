// Reading a container: one grid of it, a whole file, a frame, or a part; and what a file holds without its contents.

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "core/counted.h"
#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "format/ellipsoid_sections.h"
#include "format/frame_table.h"
#include "format/non_finite_section.h"
#include "format/records.h"
#include "format/section_reader.h"
#include "format/voxel_sections.h"

namespace esvr {

namespace format {

// ---- One grid

namespace {

bool encloses(const Box& outer, const Box& inner) {
  return inner.empty() || (outer.contains(inner.min) && outer.contains(inner.max));
}

/// The file that grids are read from.
struct GridsOfFile {
  SectionReader& sections;
  GridRecords& records;
  const ReadPart* part = nullptr;      ///< the part to read; null: all of it
  const EsvrFile* previous = nullptr;  ///< the frame before; null: the file stands alone
};

struct DecodedGrid {
  StoredGrid grid;
  std::uint64_t ellipsoidsInFile = 0;  ///< ellipsoids of the whole grid
};

/// A chunk whose section of layered ellipsoids is open.
struct OpenChunk {
  std::unique_ptr<ByteSource> section;  ///< null: the chunk has no layers, or is not wanted
  BlockDirectory directory;
};

/// Reads one grid of a file, or what a part needs of it.
class GridDecoder {
 public:
  GridDecoder(const GridsOfFile& file, std::uint32_t grid)
      : sections_(file.sections),
        records_(file.records),
        g_(grid),
        part_(file.part),
        previous_(file.previous) {}

  /// Reads the record of a grid alone. \throws BadInput  the record is damaged
  DecodedGrid decodeRecord() { return readRecords(); }

  /// \param before  the grids before this one
  /// \throws BadInput  the grid is damaged
  DecodedGrid decode(std::span<const StoredGrid> before) {
    DecodedGrid decoded = readRecords();
    StoredGrid& grid = decoded.grid;
    readChunks(grid);
    if (grid.topology == TopologyKind::kMask) readMask(grid);
    if (grid.topology == TopologyKind::kBricks)
      ifThere(SectionKind::kBricks, [&](const Content& content, const std::string& where) {
        grid.bricks = getBricks(content, where);
      });
    ifThere(SectionKind::kVoxels, [&](const Content& content, const std::string& where) {
      grid.voxels = getVoxels(content, where, sections_.budget());
    });
    ifThere(SectionKind::kRelated, [&](const Content& content, const std::string& where) {
      if (grid.voxels) throw BadInput(where + ": the grid has two sets of voxels");
      getRelated(content, where, before, sections_.budget(), grid);
    });
    // A residual corrects the sum of all layers.
    if (layers_ == kAllLayers)
      ifThere(SectionKind::kResidual, [&](const Content& content, const std::string& where) {
        grid.residual = getVoxels(content, where, sections_.budget());
        refuse(residualFaultOf(grid));
      });
    getNonFinite(sections_, g_, previous_, grid);
    // The errors of layers hold for whole grids only.
    if (!part_ || !part_->box)
      ifThere(SectionKind::kLayerErrors, [&](const Content& content, const std::string& where) {
        grid.layerErrors = getLayerErrors(content, layersInFile_, where);
        grid.layerErrors.resize(layerCount(grid));
      });
    if (!part_)
      ifThere(SectionKind::kCurve, [&](const Content& content, const std::string& where) {
        grid.curve = getCurve(content, where);
      });
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
      in.fail("not a table of " + counted(count, "chunk"));
    std::vector<ChunkRecord> records;
    for (std::uint32_t c = 0; c < count; ++c) codeChunk(in, records.emplace_back());
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
    return !part_ || !part_->box || !common(box, *part_->box).empty();
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
      chunk.ellipsoids = readExact(c, record.count);
    else
      chunk.ellipsoids = readQuantised(c, record.count, grid.quantised[c]);
    refuse(faultOf(chunk.ellipsoids), c);
    if (!encloses(record.box, centerBox(chunk, all(chunk))))
      refuse(Fault{SectionKind::kCenters, "a center lies outside the chunk's box"}, c);
    return chunk;
  }

  /// Ellipsoids in float32, which are stored as they are.
  Ellipsoids readExact(std::uint32_t c, std::uint64_t count) {
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

  void readMask(StoredGrid& grid) {
    const auto section = id(SectionKind::kMask);
    Mask mask = getMask(sections_.get(section), sections_.place(section), sections_.budget());
    grid.bricks = std::move(mask.bricks);
    grid.mask = std::move(mask.active);
  }

  using Content = std::vector<std::byte>;

  /// Calls read(content, where) for a section of the grid, if there is one. \param read  `where` begins error texts
  template <class Read>
  void ifThere(SectionKind kind, const Read& read) {
    const auto section = id(kind);
    if (sections_.has(section)) read(sections_.get(section), sections_.place(section));
  }

  static constexpr std::size_t kAllLayers = std::numeric_limits<std::size_t>::max();

  SectionReader& sections_;
  GridRecords& records_;
  std::uint32_t g_;
  const ReadPart* part_;
  const EsvrFile* previous_;
  std::vector<ChunkRecord> chunks_;
  std::size_t layers_ = kAllLayers;  ///< number of layers to read
  std::size_t layersInFile_ = 0;     ///< largest number of layers of a chunk that was opened
};

}  // namespace

// ---- Files, frames and parts

namespace {

std::vector<MetaItem> readFileMetadata(SectionReader& sections) {
  const SectionId section{SectionKind::kFileMetadata};
  if (!sections.has(section)) return {};
  const auto content = sections.get(section);
  ByteReader in(content, sections.place(section));
  std::vector<MetaItem> items;
  codeMetadata(in, items);
  in.finish();
  return items;
}

/// What is read of the bytes of carried grids.
enum class CarriedBytes { kNothing, kChecked, kAll };

CarriedGrid readCarriedGrid(SectionReader& sections, std::uint32_t number, CarriedBytes bytes) {
  const SectionId record{SectionKind::kCarried, number};
  const auto content = sections.get(record);
  ByteReader in(content, sections.place(record));
  CarriedGrid grid;
  codeCarried(in, grid);
  in.finish();
  const SectionId stored{SectionKind::kCarriedBytes, number};
  if (bytes == CarriedBytes::kAll) grid.bytes = sections.getCarried(stored);
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

/// Reads a grid that refers to the grid of the same number in the previous frame.
StoredGrid readAfter(SectionReader& sections, const SectionId& section, const EsvrFile& previous) {
  const std::string where = sections.place(section);
  if (section.grid >= previous.grids.size())
    throw BadInput(where + ": the frame before has only " + std::to_string(previous.grids.size()) +
                   " grids");
  StoredGrid grid =
      getPredicted(sections.get(section), where, previous.grids[section.grid], sections.budget());
  if (const auto fault = faultOf(grid)) throw BadInput(where + ": " + fault->text);
  getNonFinite(sections, section.grid, &previous, grid);
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
    const GridsOfFile source{.sections = sections, .records = records, .part = part};
    GridDecoder decoder(source, g);
    DecodedGrid decoded = needed[g] ? decoder.decode(file.grids) : decoder.decodeRecord();
    file.grids.push_back(std::move(decoded.grid));
    ellipsoids.push_back(decoded.ellipsoidsInFile);
  }
  return ellipsoids;
}

/// Reads the grids of a frame that refers to the previous one, and its layout.
void readGridsAfter(SectionReader& sections, const EsvrFile& previous, EsvrFile& file) {
  if (sections.has({SectionKind::kGridRecords})) file.layout = FileLayout::kCompact;
  GridRecords records(sections);
  const GridsOfFile source{.sections = sections, .records = records, .previous = &previous};
  const std::uint32_t count = records.count() + sections.count(SectionKind::kPredicted);
  for (std::uint32_t g = 0; g < count; ++g) {
    const SectionId difference{SectionKind::kPredicted, g};
    file.grids.push_back(sections.has(difference) ? readAfter(sections, difference, previous)
                                                  : GridDecoder(source, g).decode(file.grids).grid);
  }
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

namespace {

std::uint64_t heapBytesOf(const VoxelLayer& layer) {
  const std::uint64_t codes = layer.codes.size() * sizeof(std::int32_t);
  return (layer.codes.get_allocator().memory().isInFile(codes) ? 0 : codes) +
         layer.bricks.size() * (sizeof(Coord) + 2 * sizeof(BrickMask));
}

std::uint64_t heapBytesOf(const StoredGrid& grid) {
  double ellipsoids = 0.0;
  for (const Chunk& chunk : grid.field.chunks)
    ellipsoids += double(chunk.ellipsoids.size()) * format::kDecodedBytesPerEllipsoid;
  return std::uint64_t(ellipsoids) + grid.bricks.size() * sizeof(Coord) +
         grid.mask.size() * sizeof(BrickMask) + (grid.voxels ? heapBytesOf(*grid.voxels) : 0) +
         (grid.residual ? heapBytesOf(*grid.residual) : 0) +
         (grid.nonFiniteVoxels ? heapBytesOf(*grid.nonFiniteVoxels) : 0);
}

}  // namespace

std::uint64_t contentBytes(const EsvrFile& file) {
  std::uint64_t bytes = 0;
  for (const StoredGrid& grid : file.grids) bytes += heapBytesOf(grid);
  for (const CarriedGrid& grid : file.carried)
    if (!grid.bytes.get_allocator().memory().isInFile(grid.bytes.size()))
      bytes += grid.bytes.size();
  return bytes;
}

EsvrFile decodeEsvr(std::span<const std::byte> bytes, const std::string& nameForErrors,
                    const ReadLimits& limits) {
  return format::decode(format::MemorySource(bytes, nameForErrors), limits);
}

// ---- Files by their paths

namespace {

/// Takes the bytes of packed sections from those of the section that holds them.
void countPackedOnce(const format::SectionTable& table, EsvrSummary& summary) {
  using format::SectionKind;
  const auto holder = std::ranges::find(table.entries, format::SectionId{SectionKind::kPacked},
                                        &format::SectionEntry::id);
  if (holder == table.entries.end()) return;
  std::uint64_t& bytes = summary.sections[std::size_t(holder - table.entries.begin())].storedBytes;
  for (std::size_t i = 0; i < table.entries.size(); ++i) {
    const auto& e = table.entries[i];
    const bool isInside =
        e.offset > holder->offset && e.offset < holder->offset + holder->storedBytes;
    if (isInside && !summary.sections[i].sharedWith) bytes -= e.storedBytes;
  }
}

EsvrSummary summaryOf(const format::SectionTable& table) {
  EsvrSummary summary{table.versionMajor, table.versionMinor, table.fileBytes, {}};
  std::map<format::Placement, std::size_t> first;
  for (const auto& e : table.entries) {
    const auto [same, isFirst] = first.emplace(format::placementOf(e), summary.sections.size());
    summary.sections.push_back({format::nameOf(e.id.kind), format::nameOf(e.codec), e.id.grid,
                                e.storedBytes, e.rawBytes,
                                isFirst ? std::nullopt : std::optional(same->second)});
  }
  countPackedOnce(table, summary);
  return summary;
}

}  // namespace

EsvrFile readEsvr(const std::filesystem::path& path, const ReadLimits& limits) {
  return format::decode(format::FileSource(path), limits);
}

PartOfFile readEsvrPart(const std::filesystem::path& path, const ReadPart& part) {
  return format::decodePart(format::FileSource(path), part);
}

EsvrSummary inspectEsvr(const std::filesystem::path& path) {
  return summaryOf(format::readAllRows(format::FileSource(path)));
}

EsvrSummary inspectEsvr(std::span<const std::byte> bytes, const std::string& nameForErrors) {
  return summaryOf(format::isShortFrame(bytes)
                       ? format::getFrame(bytes, nameForErrors).sections
                       : format::readAllRows(format::MemorySource(bytes, nameForErrors)));
}

// ---- The order of the grids

namespace {

/// The grids that are not carried, in order: those of numbers, and those of vectors in place of
/// their components.
class OthersInOrder {
 public:
  explicit OthersInOrder(const EsvrFile& file) : file_(file) {}

  /// Number of components and grids of numbers that were taken.
  [[nodiscard]] std::size_t taken() const { return taken_; }
  [[nodiscard]] bool done() const { return taken_ == file_.grids.size(); }

  GridOfFile take() {
    if (vector_ == file_.vectors.size() || file_.vectors[vector_].first > taken_)
      return {false, taken_++};
    requireComponents(file_.vectors[vector_]);
    taken_ += kComponents;
    return {false, vector_++, true};
  }

  /// \throws RuntimeFailure  a vector was not reached
  void finish() const {
    if (vector_ < file_.vectors.size()) requireComponents(file_.vectors[vector_]);
  }

 private:
  void requireComponents(const StoredVector& vector) const {
    const std::size_t grids = file_.grids.size();
    if (vector.first != taken_ || grids - taken_ < kComponents)
      throw RuntimeFailure("grid '" + shownName(vector.name) +
                           "' has no three components of its own from " +
                           std::to_string(vector.first) + " on among " + counted(grids, "grid"));
  }

  const EsvrFile& file_;
  std::size_t taken_ = 0, vector_ = 0;
};

}  // namespace

std::vector<GridOfFile> gridsInOrder(const EsvrFile& file) {
  OthersInOrder others(file);
  std::vector<GridOfFile> order;
  for (std::size_t c = 0; c < file.carried.size(); ++c) {
    const std::size_t place = file.carried[c].place;
    while (!others.done() && others.taken() + c < place) order.push_back(others.take());
    if (others.taken() + c != place)
      throw RuntimeFailure("grid '" + shownName(file.carried[c].name) + "' cannot have place " +
                           std::to_string(place) + " among " +
                           counted(file.grids.size() + file.carried.size(), "grid"));
    order.push_back({true, c});
  }
  while (!others.done()) order.push_back(others.take());
  others.finish();
  return order;
}

const std::string& nameOf(const EsvrFile& file, const GridOfFile& grid) {
  if (grid.isCarried) return file.carried[grid.index].name;
  if (grid.isVector) return file.vectors[grid.index].name;
  return file.grids[grid.index].descriptor.name;
}

std::vector<std::string> namesInOrder(const EsvrFile& file) {
  std::vector<std::string> names;
  for (const GridOfFile& grid : gridsInOrder(file)) names.push_back(nameOf(file, grid));
  return names;
}

std::vector<std::string> namesOfStored(const EsvrFile& file) {
  const GridNames names(namesInOrder(file));
  std::vector<std::string> stored(file.grids.size());
  std::size_t place = 0;
  for (const GridOfFile& grid : gridsInOrder(file)) {
    if (grid.isVector)
      for (std::size_t c = 0; c < kComponents; ++c)
        stored[file.vectors[grid.index].first + c] = names.ofComponent(place, c);
    else if (!grid.isCarried)
      stored[grid.index] = names.unique(place);
    ++place;
  }
  return stored;
}

std::size_t findStored(const EsvrFile& file, const std::string& wanted,
                       const std::filesystem::path& path) {
  const GridNames names(namesInOrder(file));
  const NamedGrid found = names.find(wanted, path);
  const GridOfFile grid = gridsInOrder(file)[found.place];
  const std::string where =
      (path.empty() ? "" : path.string() + ": ") + "grid \"" + names.unique(found.place) + "\" ";
  if (grid.isCarried)
    throw BadInput(where +
                   "is carried unchanged, as the bytes of its .vdb file; esvr2vdb restores it");
  if (grid.isVector && !found.component)
    throw BadInput(where + "has vectors; name a component, such as \"" +
                   names.ofComponent(found.place, 0) + '"');
  if (found.component && !grid.isVector) throw BadInput(where + "has no components");
  return grid.isVector ? file.vectors[grid.index].first + *found.component : grid.index;
}

StoredComponents componentsOf(const EsvrFile& file, const StoredVector& vector) {
  return std::span(file.grids).subspan(vector.first).first<kComponents>();
}

}  // namespace esvr
