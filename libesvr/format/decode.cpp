#include "format/decode.h"

#include <algorithm>
#include <utility>

#include "esvr/error.h"
#include "format/chunk_box.h"
#include "format/curve_stream.h"
#include "format/ellipsoids_section.h"
#include "format/grid_record.h"
#include "format/leaves_stream.h"
#include "format/planes.h"
#include "format/section_reader.h"
#include "format/validity.h"
#include "format/voxel_section.h"

namespace esvr {
namespace {

using namespace format;

bool encloses(const Box& outer, const Box& inner) {
  return inner.empty() || (outer.contains(inner.min) && outer.contains(inner.max));
}

/// Reads one grid of a file.
class GridDecoder {
 public:
  GridDecoder(SectionReader& sections, std::uint32_t grid) : sections_(sections), g_(grid) {}

  EncodedGrid decode() {
    GridRecord record = readRecord();
    EncodedGrid grid = std::move(record.grid);
    if (record.chunkCount > 1) record.chunks = readChunkTable(record.chunkCount);
    if (anyQuantised(record.chunks.size())) grid.quantised.resize(record.chunks.size());
    for (std::uint32_t c = 0; c < record.chunks.size(); ++c)
      grid.field.chunks.push_back(readChunk(c, record.chunks[c], grid));
    if (grid.topology == TopologyKind::kLeaves) readLeaves(grid);
    readVoxels(grid);
    readCurve(grid);
    return grid;
  }

 private:
  [[nodiscard]] SectionId id(SectionKind kind, std::uint32_t chunk = kNone) const {
    return {kind, g_, chunk};
  }

  void refuse(const std::optional<Fault>& fault, std::uint32_t chunk = kNone) const {
    if (!fault) return;
    const auto quantised = id(SectionKind::kEllipsoids, chunk);
    const auto own = id(fault->section, chunk);
    throw BadInput(sections_.place(wasThere(quantised) ? quantised : own) + ": " + fault->text);
  }

  [[nodiscard]] bool wasThere(const SectionId& section) const {
    const auto& entries = sections_.table().entries;
    return std::any_of(entries.begin(), entries.end(),
                       [&](const auto& entry) { return entry.id == section; });
  }

  GridRecord readRecord() {
    const auto content = sections_.get(id(SectionKind::kGrid));
    ByteReader in(content, sections_.place(id(SectionKind::kGrid)));
    GridRecord record = getGrid(in);
    in.finish();
    refuse(faultOf(record.grid));
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

  /// All of a grid's chunks that have ellipsoids are quantised, or none.
  [[nodiscard]] bool anyQuantised(std::size_t chunks) const {
    for (std::uint32_t c = 0; c < chunks; ++c)
      if (sections_.has(id(SectionKind::kEllipsoids, c))) return true;
    return false;
  }

  Chunk readChunk(std::uint32_t c, const ChunkRecord& record, EncodedGrid& grid) {
    Chunk chunk{record.origin, {}};
    if (record.count != 0 && grid.quantised.empty())
      chunk.ellipsoids = readEllipsoids(c, record.count);
    else if (record.count != 0)
      chunk.ellipsoids = readQuantised(c, record.count, grid.quantised[c]);
    refuse(faultOf(chunk.ellipsoids), c);
    if (!encloses(record.box, centerBox(chunk)))
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
    quantised = getEllipsoids(sections_.get(section), count, sections_.place(section));
    return dequantise(quantised);
  }

  void readLeaves(EncodedGrid& grid) {
    const auto section = id(SectionKind::kLeaves);
    if (sections_.has(section))
      grid.leaves = getLeaves(sections_.get(section), sections_.place(section));
  }

  void readVoxels(EncodedGrid& grid) {
    const auto section = id(SectionKind::kVoxels);
    if (sections_.has(section))
      grid.voxels = getVoxels(sections_.get(section), sections_.place(section));
  }

  void readCurve(EncodedGrid& grid) {
    const auto section = id(SectionKind::kCurve);
    if (sections_.has(section))
      grid.curve = getCurve(sections_.get(section), sections_.place(section));
  }

  SectionReader& sections_;
  std::uint32_t g_;
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

EsvrFile decode(const ByteSource& source) {
  SectionReader sections(source);
  EsvrFile file;
  file.metadata = readFileMetadata(sections);
  const std::uint32_t grids = sections.count(SectionKind::kGrid);
  for (std::uint32_t g = 0; g < grids; ++g) file.grids.push_back(GridDecoder(sections, g).decode());
  sections.finish();
  return file;
}

}  // namespace format

EsvrFile decodeEsvr(std::span<const std::byte> bytes, const std::string& nameForErrors) {
  return format::decode(format::MemorySource(bytes, nameForErrors));
}

}  // namespace esvr
