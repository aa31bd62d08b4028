// Writing a container: the checks of a grid, the order of its ellipsoids, and the sections of a file or of a frame.

#include "format/section_writer.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "codec/brick_coder.h"
#include "core/atomic_file.h"
#include "core/parallel.h"
#include "esvr/container.h"
#include "esvr/grid.h"
#include "format/ellipsoid_sections.h"
#include "format/non_finite_section.h"
#include "format/records.h"
#include "format/voxel_sections.h"

namespace esvr {

// ---- The order of ellipsoids

namespace format {
namespace {

constexpr int kBitsPerAxis = 21;  // three of these make a 64-bit key
constexpr double kCellsPerVoxel = 256.0;
constexpr double kLastCell = double((1u << kBitsPerAxis) - 1);  // at 8192 voxels

/// Adds one coordinate to the keys of all ellipsoids. Cells are counted from the lowest center.
void addAxis(const std::vector<float>& center, int axis, std::vector<std::uint64_t>& keys) {
  if (center.empty()) return;
  const double low = *std::min_element(center.begin(), center.end());
  for (std::size_t i = 0; i < center.size(); ++i) {
    const double cell = std::min((center[i] - low) * kCellsPerVoxel, kLastCell);
    keys[i] |= spreadBits(std::uint64_t(cell)) << axis;
  }
}

std::vector<float> picked(const std::vector<float>& values, const std::vector<std::size_t>& order) {
  std::vector<float> result;
  if (values.empty()) return result;
  result.reserve(order.size());
  for (const auto i : order) result.push_back(values[i]);
  return result;
}

}  // namespace

Ellipsoids inMortonOrder(const Ellipsoids& e) {
  std::vector<std::uint64_t> keys(e.size());
  for (int axis = 0; axis < 3; ++axis) addAxis(e.center[std::size_t(axis)], axis, keys);
  std::vector<std::size_t> order(e.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return keys[a] < keys[b]; });

  Ellipsoids sorted;
  for (std::size_t c = 0; c < 3; ++c) sorted.center[c] = picked(e.center[c], order);
  for (std::size_t c = 0; c < 3; ++c) sorted.logScale[c] = picked(e.logScale[c], order);
  for (std::size_t c = 0; c < 4; ++c) sorted.rotation[c] = picked(e.rotation[c], order);
  sorted.intensity = picked(e.intensity, order);
  sorted.kappa = picked(e.kappa, order);
  return sorted;
}

}  // namespace format

// ---- Sections of a file

namespace {

using namespace format;

constexpr std::uint16_t kOptional = 0;

/// A grid with its chunks in the order of the file, and their records.
struct SortedGrid {
  const StoredGrid& grid;
  std::vector<Chunk> chunks;
  std::vector<ChunkRecord> records;
};

[[noreturn]] void refuse(const StoredGrid& grid, const std::string& what) {
  throw RuntimeFailure("cannot store grid '" + shownName(grid.descriptor.name) + "': " + what);
}

void checkLayers(const StoredGrid& grid) {
  for (const auto& q : grid.quantised) {
    const auto& ends = q.layerEnds;
    if (ends.empty()) continue;
    if (ends.size() < 2 || ends.front() == 0 || ends.back() != q.size() ||
        std::adjacent_find(ends.begin(), ends.end(), std::greater_equal<>()) != ends.end())
      refuse(grid, "its layers do not divide a chunk");
  }
  if (!grid.layerErrors.empty() && grid.layerErrors.size() != layerCount(grid))
    refuse(grid, "it has not one error for each layer");
}

void checkGrid(const StoredGrid& grid) {
  if (const auto fault = faultOf(grid)) refuse(grid, fault->text);
  if (grid.topology == TopologyKind::kThreshold && !grid.bricks.empty())
    refuse(grid, "it has bricks, but a topology without");
  if (grid.mask.size() != (grid.topology == TopologyKind::kMask ? grid.bricks.size() : 0))
    refuse(grid, "its mask is not that of its topology");
  if (grid.reference && !grid.voxels) refuse(grid, "it has a reference, but no voxels");
  if (!grid.quantised.empty() && grid.quantised.size() != grid.field.chunks.size())
    refuse(grid, "its quantised chunks are not those of its field");
  checkLayers(grid);
  if (const auto fault = residualFaultOf(grid)) refuse(grid, fault->text);
  if (const auto fault = nonFiniteFaultOf(grid)) refuse(grid, fault->text);
  for (std::size_t c = 0; c < grid.field.chunks.size(); ++c) {
    const auto& ellipsoids = grid.field.chunks[c].ellipsoids;
    checkInvariants(ellipsoids);
    if (const auto fault = faultOf(ellipsoids))
      refuse(grid, fault->text + " (chunk " + std::to_string(c) + ")");
    if (!grid.quantised.empty() && !(dequantise(grid.quantised[c]) == ellipsoids))
      refuse(grid, "its field is not what is quantised (chunk " + std::to_string(c) + ")");
  }
}

SortedGrid sorted(const StoredGrid& grid) {
  SortedGrid result{grid, {}, {}};
  for (const auto& chunk : grid.field.chunks) {
    result.chunks.push_back({chunk.origin, grid.quantised.empty() ? inMortonOrder(chunk.ellipsoids)
                                                                  : chunk.ellipsoids});
    result.records.push_back(
        {chunk.origin, supportBox(chunk, all(chunk), grid.field.kernel), chunk.ellipsoids.size()});
  }
  return result;
}

void addFileMetadata(SectionWriter& out, const EsvrFile& file) {
  if (file.metadata.empty()) return;
  ByteWriter content;
  codeMetadata(content, file.metadata);
  out.add({SectionKind::kFileMetadata}, kRequired, content.take());
}

std::vector<std::byte> recordOf(const SortedGrid& grid) {
  ByteWriter content;
  putGrid(content, grid.grid, grid.records);
  return content.take();
}

void addGrid(SectionWriter& out, std::uint32_t g, const SortedGrid& grid) {
  out.add({SectionKind::kGrid, g}, kRequired, recordOf(grid));
}

/// Adds the chunk records of a grid with several chunks; the record of a single chunk is in the
/// grid's own record.
void addChunkTable(SectionWriter& out, std::uint32_t g, const SortedGrid& grid) {
  if (grid.records.size() < 2) return;
  ByteWriter content;
  for (const auto& record : grid.records) codeChunk(content, record);
  out.add({SectionKind::kChunks, g}, kRequired, content.take());
}

void addChunk(SectionWriter& out, std::uint32_t g, std::uint32_t c, const Ellipsoids& e) {
  const auto add = [&](SectionKind kind, std::span<const Plane> planes) {
    out.addPacked({kind, g, c}, kRequired, packFloats(putPlanes(planes)));
  };
  if (e.size() == 0) return;
  add(SectionKind::kCenters, e.center);
  add(SectionKind::kScales, e.logScale);
  if (!allIdentity(e.rotation)) add(SectionKind::kRotations, e.rotation);
  add(SectionKind::kIntensities, {&e.intensity, 1});
  if (!e.kappa.empty()) add(SectionKind::kKappas, {&e.kappa, 1});
}

std::vector<Box> blockBoxes(const Chunk& chunk, const QuantisedEllipsoids& q,
                            const Kernel& kernel) {
  std::vector<Box> boxes;
  for (const Run run : blockRuns(q)) boxes.push_back(supportBox(chunk, run, kernel));
  return boxes;
}

void addQuantised(SectionWriter& out, std::uint32_t g, std::uint32_t c, const SortedGrid& grid) {
  const QuantisedEllipsoids& q = grid.grid.quantised[c];
  if (q.size() == 0) return;
  if (q.layerEnds.empty())
    out.addRaw({SectionKind::kEllipsoids, g, c}, kRequired, putEllipsoids(q));
  else
    out.addRaw(
        {SectionKind::kLayered, g, c}, kRequired,
        putLayered(q, grid.records[c].box, blockBoxes(grid.chunks[c], q, grid.grid.field.kernel)));
}

void addChunks(SectionWriter& out, std::uint32_t g, const SortedGrid& grid) {
  const bool quantised = !grid.grid.quantised.empty();
  for (std::uint32_t c = 0; c < grid.chunks.size(); ++c)
    if (quantised)
      addQuantised(out, g, c, grid);
    else
      addChunk(out, g, c, grid.chunks[c].ellipsoids);
}

/// The voxels of a grid that refers to another one, coded.
std::vector<std::byte> relatedOf(std::uint32_t g, std::span<const StoredGrid> grids) {
  const StoredGrid& grid = grids[g];
  const VoxelReference& reference = *grid.reference;
  const bool isThere = !reference.grid || (*reference.grid < g && grids[*reference.grid].voxels);
  if (!isThere) refuse(grid, "it refers to a grid that is not before it or has no voxels");
  auto content = putRelated(*grid.voxels, reference,
                            reference.grid ? &*grids[*reference.grid].voxels : nullptr);
  if (!content) refuse(grid, "its voxels cannot be coded with those of the grid it refers to");
  return std::move(*content);
}

/// \param related  relatedOf() the grid, if it refers to another one
void addExtras(SectionWriter& out, std::uint32_t g, const StoredGrid& grid,
               std::vector<std::byte> related) {
  if (grid.topology == TopologyKind::kMask)
    out.addRaw({SectionKind::kMask, g}, kRequired, putMask(grid.bricks, grid.mask));
  else if (!grid.bricks.empty())
    out.add({SectionKind::kBricks, g}, kRequired, putBricks(grid.bricks));
  if (grid.residual) out.addVoxels({SectionKind::kResidual, g}, *grid.residual);
  if (grid.reference)
    out.addRaw({SectionKind::kRelated, g}, kRequired, std::move(related));
  else if (grid.voxels)
    out.addVoxels({SectionKind::kVoxels, g}, *grid.voxels);
  if (!grid.layerErrors.empty())
    out.addRaw({SectionKind::kLayerErrors, g}, kOptional, putLayerErrors(grid.layerErrors));
  if (!grid.curve.empty()) out.add({SectionKind::kCurve, g}, kOptional, putCurve(grid.curve));
}

/// \param before  the same grid of the frame before; null: the grid stands alone
void addNonFinite(SectionWriter& out, std::uint32_t g, const StoredGrid& grid,
                  const StoredGrid* before) {
  if (grid.nonFiniteVoxels)
    out.addRaw({SectionKind::kNonFinite, g}, kRequired, putNonFinite(grid, before));
}

/// The grid of the same number in the frame before; null if there is none.
const StoredGrid* gridBefore(const EsvrFile* previous, std::size_t g) {
  return previous && g < previous->grids.size() ? &previous->grids[g] : nullptr;
}

/// Adds the records of carried grids.
/// \param first  number of the first of them
void addCarriedRecords(SectionWriter& out, const std::vector<CarriedGrid>& grids,
                       std::size_t first) {
  for (std::size_t c = 0; c < grids.size(); ++c) {
    ByteWriter content;
    codeCarried(content, grids[c]);
    out.add({SectionKind::kCarried, std::uint32_t(first + c)}, kOptional, content.take());
  }
}

void addCarriedBytes(SectionWriter& out, const std::vector<CarriedGrid>& grids, std::size_t first) {
  for (std::size_t c = 0; c < grids.size(); ++c) {
    if (grids[c].bytes.empty())
      throw RuntimeFailure("cannot store grid '" + shownName(grids[c].name) +
                           "': its bytes were not read");
    out.addCarried({SectionKind::kCarriedBytes, std::uint32_t(first + c)}, grids[c].bytes);
  }
}

void addVectors(SectionWriter& out, const std::vector<StoredVector>& vectors) {
  for (const StoredVector& vector : vectors) {
    ByteWriter content;
    content.putSized(vector.name);
    out.addRaw({SectionKind::kVector, std::uint32_t(vector.first)}, kOptional, content.take());
  }
}

void checkVectors(const EsvrFile& file) {
  for (const StoredVector& vector : file.vectors)
    if (const auto fault = faultOf(componentsOf(file, vector)))
      throw RuntimeFailure("cannot store grid '" + shownName(vector.name) + "': " + fault->text);
}

/// What a frame need not store, because the previous one has it too.
Inherited inheritedFrom(const EsvrFile& previous, const EsvrFile& frame) {
  return {previous.metadata == frame.metadata, previous.vectors == frame.vectors,
          previous.carried == frame.carried};
}

using Differences = std::vector<std::optional<std::vector<std::byte>>>;

/// Adds encoded grid records in one section.
/// \return false if a reader would refuse so many records in so few bytes; nothing is added then
bool addJoined(SectionWriter& out, const std::vector<std::vector<std::byte>>& records) {
  Packed packed = pack(putRecords(records));
  if (packed.bytes.size() < records.size()) return false;
  out.addPacked({SectionKind::kGridRecords}, kRequired, std::move(packed));
  return true;
}

/// Adds the records of the grids that have no difference.
void addRecords(SectionWriter& out, const std::vector<SortedGrid>& grids,
                const Differences& differences) {
  std::vector<std::vector<std::byte>> records;
  for (std::size_t g = 0; g < grids.size(); ++g)
    if (!differences[g]) records.push_back(recordOf(grids[g]));
  const bool joins = out.layout() == FileLayout::kCompact && records.size() > 1;
  if (joins && addJoined(out, records)) return;
  for (std::uint32_t g = 0; g < grids.size(); ++g)
    if (!differences[g]) addGrid(out, g, grids[g]);
}

/// What is known of the frame before a frame that refers to it.
struct FrameContext {
  Differences
      differences;  ///< for each grid: its difference from the frame before, which replaces it
  Inherited inherited{};
  const EsvrFile* previous = nullptr;  ///< null: the file stands alone
};

/// Checks a file and collects its sections.
SectionWriter collect(const EsvrFile& file, const FrameContext& context) {
  const auto& [differences, inherited, previous] = context;
  (void)gridsInOrder(file);  // refuses places that are impossible
  checkVectors(file);
  std::vector<SortedGrid> grids;
  for (const auto& grid : file.grids) {
    checkGrid(grid);
    grids.push_back(sorted(grid));
  }

  // Records come first, so that one read at the beginning of the file is enough to list it.
  SectionWriter out;
  out.setLayout(file.layout);
  constexpr std::uint16_t kFactsOfVoxels = 5;  // far backgrounds, box voxels and tone curves
  if (std::ranges::any_of(file.grids, [](const StoredGrid& grid) {
        return grid.farBackground || !grid.boxVoxels.empty() || grid.tone.isOn();
      }))
    out.requireVersion(kFactsOfVoxels);
  if (!inherited.metadata) addFileMetadata(out, file);
  addRecords(out, grids, differences);
  for (std::uint32_t g = 0; g < grids.size(); ++g)
    if (differences[g])
      out.addRaw({SectionKind::kPredicted, g}, kRequired, std::vector(*differences[g]));
  if (!inherited.vectors) addVectors(out, file.vectors);
  if (!inherited.carried) addCarriedRecords(out, file.carried, grids.size());
  for (std::uint32_t g = 0; g < grids.size(); ++g) addChunkTable(out, g, grids[g]);
  // Related voxels of a grid are coded by one thread, so that those of several grids are coded at the same time.
  std::vector<std::vector<std::byte>> related(grids.size());
  parallelFor(std::uint32_t{0}, std::uint32_t(grids.size()), [&](std::uint32_t g) {
    if (!context.differences[g] && file.grids[g].reference) related[g] = relatedOf(g, file.grids);
  });
  for (std::uint32_t g = 0; g < grids.size(); ++g) {
    addNonFinite(out, g, file.grids[g], gridBefore(previous, g));
    if (differences[g]) continue;
    addChunks(out, g, grids[g]);
    addExtras(out, g, file.grids[g], std::move(related[g]));
  }
  if (!inherited.carried) addCarriedBytes(out, file.carried, grids.size());
  return out;
}

}  // namespace

namespace format {

std::uint64_t bytesOfNonFinite(const StoredGrid& grid) {
  if (!grid.nonFiniteVoxels) return 0;
  SectionWriter out;
  out.addRaw({SectionKind::kNonFinite, 0}, kRequired, putNonFinite(grid, nullptr));
  return out.bytesUnshared();
}

SectionWriter sectionsOf(const EsvrFile& file) {
  return collect(file, {Differences(file.grids.size())});
}

std::optional<std::vector<std::byte>> differenceOf(const StoredGrid& grid,
                                                   const StoredGrid& previous,
                                                   std::uint64_t ownBytes) {
  auto content = putPredicted(grid, previous);
  if (content && content->size() + kFrameRowBytes >= ownBytes) content.reset();
  return content;
}

namespace {

/// Bytes of a grid in a frame if it is not stored as a difference, without the voxels that are not finite. The record of a grid that refers
/// to another one is estimated, because it is compressed together with others.
std::uint64_t bytesOfOwn(const EsvrFile& frame, std::size_t g) {
  constexpr std::uint64_t kJoinedRecordBytes = 64;
  if (!frame.grids[g].reference) return bytesAdded(frame, g) - bytesOfNonFinite(frame.grids[g]);
  SectionWriter out;
  out.addRaw({SectionKind::kRelated, std::uint32_t(g)}, kRequired,
             relatedOf(std::uint32_t(g), frame.grids));
  return out.bytesUnshared() - kEntryBytes + kFrameRowBytes + kJoinedRecordBytes;
}

std::optional<FrameSections> collectDifferences(const EsvrFile& frame, const EsvrFile& previous) {
  Differences differences(frame.grids.size());
  bool any = false;
  for (std::size_t g = 0; g < std::min(frame.grids.size(), previous.grids.size()); ++g) {
    differences[g] = differenceOf(frame.grids[g], previous.grids[g], bytesOfOwn(frame, g));
    any = any || differences[g];
  }
  if (!any) return std::nullopt;
  const Inherited inherited = inheritedFrom(previous, frame);
  return FrameSections{collect(frame, {std::move(differences), inherited, &previous}), inherited};
}

std::uint64_t frameBytesOf(const std::optional<FrameSections>& frame) {
  return frame ? frame->sections.assembleFrame(frame->inherited).size()
               : std::numeric_limits<std::uint64_t>::max();
}

EsvrFile withoutReferences(EsvrFile frame) {
  for (StoredGrid& grid : frame.grids) grid.reference.reset();
  return frame;
}

}  // namespace

std::optional<FrameSections> differencesOf(const EsvrFile& frame, const EsvrFile& previous) {
  const bool refers = std::ranges::any_of(
      frame.grids, [](const StoredGrid& grid) { return grid.reference.has_value(); });
  auto found = collectDifferences(frame, previous);
  if (!refers) return found;
  auto plain = collectDifferences(withoutReferences(frame), previous);
  return frameBytesOf(plain) < frameBytesOf(found) ? std::move(plain) : std::move(found);
}

}  // namespace format

std::vector<std::byte> encodeEsvr(const EsvrFile& file) { return sectionsOf(file).assemble(); }

std::uint64_t writeEsvr(const std::filesystem::path& path, const EsvrFile& file,
                        const ContainerWriteOptions& options) {
  AtomicFile out(path, options.overwrite);  // refuses an existing file before anything is encoded
  const std::uint64_t bytes = sectionsOf(file).writeTo([&](auto piece) { out.write(piece); });
  out.commit();
  return bytes;
}

std::uint64_t bytesBesideGrids(const std::vector<MetaItem>& metadata) {
  return alignUp(encodeEsvr({metadata, {}}).size());
}

std::uint64_t bytesAdded(const StoredGrid& grid) {
  const EsvrFile file{{}, {grid}};
  return sectionsOf(file).bytesUnshared();
}

std::uint64_t bytesAdded(const EsvrFile& file, std::size_t grid) {
  const SortedGrid own = sorted(file.grids[grid]);
  const auto g = std::uint32_t(grid);
  SectionWriter out;
  addGrid(out, g, own);
  addChunkTable(out, g, own);
  addChunks(out, g, own);
  addExtras(out, g, own.grid,
            own.grid.reference ? relatedOf(g, file.grids) : std::vector<std::byte>{});
  addNonFinite(out, g, file.grids[grid], nullptr);
  return out.bytesUnshared();
}

std::uint64_t bytesOfCarried(const std::vector<CarriedGrid>& grids) {
  SectionWriter out;
  addCarriedRecords(out, grids, 0);
  addCarriedBytes(out, grids, 0);
  return out.bytesUnshared();
}

std::uint64_t bytesOfVectors(const std::vector<StoredVector>& vectors) {
  SectionWriter out;
  addVectors(out, vectors);
  return out.bytesUnshared();
}

std::uint64_t bytesAddedTogether(std::vector<StoredGrid> grids) {
  return alignUp(encodeEsvr({{}, std::move(grids)}).size()) - kHeaderBytes;
}

}  // namespace esvr
