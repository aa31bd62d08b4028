#include "format/decode.h"

#include <optional>
#include <utility>

#include "esvr/error.h"
#include "format/carried_record.h"
#include "format/ellipsoid_block.h"
#include "format/frame_table.h"
#include "format/grid_decoder.h"
#include "format/grid_record.h"
#include "format/grid_records.h"
#include "format/predicted_grid.h"
#include "format/related_voxels.h"
#include "format/section_reader.h"
#include "format/validity.h"

namespace esvr {
namespace format {
namespace {

std::vector<MetaItem> readFileMetadata(SectionReader& sections) {
  const SectionId section{SectionKind::kFileMetadata};
  if (!sections.has(section)) return {};
  const auto content = sections.get(section);
  ByteReader in(content, sections.place(section));
  auto items = getMetadata(in);
  in.finish();
  return items;
}

/// What is read of the bytes of carried grids.
enum class CarriedBytes { kNothing, kChecked, kAll };

CarriedGrid readCarriedGrid(SectionReader& sections, std::uint32_t number, CarriedBytes bytes) {
  const SectionId record{SectionKind::kCarried, number};
  const auto content = sections.get(record);
  ByteReader in(content, sections.place(record));
  CarriedGrid grid = getCarried(in);
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
    const GridsOfFile source{sections, records, part};
    DecodedGrid decoded =
        needed[g] ? decodeGrid(source, g, file.grids) : decodeGridRecord(source, g);
    file.grids.push_back(std::move(decoded.grid));
    ellipsoids.push_back(decoded.ellipsoidsInFile);
  }
  return ellipsoids;
}

/// Reads the grids of a frame that refers to the previous one, and its layout.
void readGridsAfter(SectionReader& sections, const EsvrFile& previous, EsvrFile& file) {
  if (sections.has({SectionKind::kGridRecords})) file.layout = FileLayout::kCompact;
  GridRecords records(sections);
  const std::uint32_t count = records.count() + sections.count(SectionKind::kPredicted);
  for (std::uint32_t g = 0; g < count; ++g) {
    const SectionId difference{SectionKind::kPredicted, g};
    file.grids.push_back(sections.has(difference)
                             ? readAfter(sections, difference, previous)
                             : decodeGrid({sections, records}, g, file.grids).grid);
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
         grid.mask.size() * sizeof(BrickMask) + grid.levels.size() * sizeof(BlockLevels) +
         (grid.voxels ? heapBytesOf(*grid.voxels) : 0) +
         (grid.residual ? heapBytesOf(*grid.residual) : 0);
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

}  // namespace esvr
