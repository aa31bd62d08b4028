// The records of a file as bytes, and their rules.

#include "format/records.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string_view>
#include <utility>

#include "core/counted.h"
#include "esvr/error.h"

namespace esvr::format {

namespace {

template <class Side>
void codeBox(Side& side, Coded<Side, Box>& box) {
  codeCoord(side, box.min);
  codeCoord(side, box.max);
}

template <class Side>
void codeTransform(Side& side, Coded<Side, Transform>& transform) {
  codeSized(side, transform.mapType);
  codeSized(side, transform.map);
  bool isAffine = transform.affine.has_value();
  codeFlag(side, isAffine, "mark of an affine map");
  if (!isAffine) return;
  if constexpr (Side::kReads) transform.affine.emplace();
  for (auto& m : *transform.affine) code(side, m);
}

template <class Side>
void codeDescriptor(Side& side, Coded<Side, GridDescriptor>& d) {
  codeSized(side, d.name);
  codeEnum(side, d.gridClass, GridClass::kStaggered, "grid class");
  codeEnum(side, d.valueType, ValueType::kDouble, "value type");
  code(side, d.background);
  codeTransform(side, d.transform);
  codeMetadata(side, d.metadata);
}

// Added to the number of a topology.
constexpr std::uint8_t kTopologies = 4;     // the numbers of topologies are below this
constexpr std::uint8_t kFarBackground = 4;  // StoredGrid::farBackground
constexpr std::uint8_t kHasBoxVoxels = 8;   // the record has StoredGrid::boxVoxels
constexpr std::uint8_t kHasTone = 16;       // the record has StoredGrid::tone
constexpr std::uint8_t kHasNonFinite = 32;  // the record has StoredGrid::nonFinite

/// What else a record has, by the number of its topology.
std::uint8_t topologyOf(const StoredGrid& grid) {
  unsigned topology = unsigned(grid.topology);
  if (grid.farBackground) topology += kFarBackground;
  if (!grid.boxVoxels.empty()) topology += kHasBoxVoxels;
  if (grid.tone.isOn()) topology += kHasTone;
  if (grid.nonFinite.total() > 0) topology += kHasNonFinite;
  return std::uint8_t(topology);
}

std::uint8_t codeTopology(ByteWriter& out, const StoredGrid& grid) {
  out.put(topologyOf(grid));
  return topologyOf(grid);
}
std::uint8_t codeTopology(ByteReader& in, StoredGrid& grid) {
  const auto topology = in.get<std::uint8_t>();
  const bool isKnown =
      topology < 2 * kHasNonFinite && topology % kTopologies <= std::uint8_t(TopologyKind::kMask);
  if (!isKnown) in.fail("unknown topology " + std::to_string(topology));
  grid.topology = TopologyKind(topology % kTopologies);
  grid.farBackground = (topology & kFarBackground) != 0;
  return topology;
}

/// Box voxels by their distances from the lowest corner of the active box.
void codeBoxVoxels(ByteWriter& out, const Box& box, const std::vector<Coord>& voxels) {
  out.put(std::uint8_t(voxels.size()));
  for (const Coord voxel : voxels)
    for (const auto axis : kAxes)
      putVarint(out, std::uint64_t(std::int64_t{voxel.*axis} - box.min.*axis));
}
void codeBoxVoxels(ByteReader& in, const Box& box, std::vector<Coord>& voxels) {
  voxels.resize(in.get<std::uint8_t>());
  if (voxels.empty()) in.fail("a list of box voxels without any");
  for (Coord& voxel : voxels)
    for (const auto axis : kAxes) {
      const std::uint64_t distance = getVarint(in);
      if (box.empty() || distance > std::uint64_t(std::int64_t{box.max.*axis} - box.min.*axis))
        in.fail("a box voxel lies outside the bounding box");
      voxel.*axis = std::int32_t(std::int64_t{box.min.*axis} + std::int64_t(distance));
    }
}

/// \param most  the number of active voxels
template <class Side>
void codeNonFiniteCounts(Side& side, std::uint64_t most, Coded<Side, NonFiniteCounts>& counts) {
  for (auto* const count : {&counts.nan, &counts.plusInfinity, &counts.minusInfinity})
    if constexpr (Side::kReads) {
      *count = getVarint(side);
      if (*count > most) side.fail("more voxels that are not finite than active ones");
      most -= *count;
    } else {
      putVarint(side, *count);
    }
  if constexpr (Side::kReads)
    if (counts.total() == 0) side.fail("a mark of voxels that are not finite without any");
}

template <class Side>
void codeVoxelFacts(Side& side, Coded<Side, StoredGrid>& grid) {
  const std::uint8_t has = codeTopology(side, grid);
  codeFlag(side, grid.withinRange, "mark of a range of values");
  code(side, grid.activeThreshold);
  codeBox(side, grid.activeBox);
  if (has & kHasBoxVoxels) codeBoxVoxels(side, grid.activeBox, grid.boxVoxels);
  if (has & kHasTone) code(side, grid.tone.scale);
  if constexpr (Side::kReads)
    if ((has & kHasTone) && !grid.tone.isOn())
      side.fail("the scale of its tone curve is not above 0");
  code(side, grid.activeVoxels);
  if (has & kHasNonFinite) codeNonFiniteCounts(side, grid.activeVoxels, grid.nonFinite);
  code(side, grid.valueMin);
  code(side, grid.valueMax);
}

/// A grid without its chunks.
template <class Side>
void codeFacts(Side& side, Coded<Side, StoredGrid>& grid) {
  codeDescriptor(side, grid.descriptor);
  codeVoxelFacts(side, grid);
  code(side, grid.field.background);
  Coded<Side, Kernel>& kernel = grid.field.kernel;
  codeEnum(side, kernel.form, KernelForm::kPaper, "kernel");
  code(side, kernel.kappa);
  code(side, kernel.epsilon);
}

}  // namespace

template <class Side>
void codeMetadata(Side& side, Coded<Side, std::vector<MetaItem>>& items) {
  auto count = std::uint32_t(items.size());
  code(side, count);
  for (std::uint32_t i = 0; i < count; ++i) {
    // Memory is not reserved for the stored count, because it is checked only by reading the items.
    if constexpr (Side::kReads) items.emplace_back();
    auto& item = items[i];
    codeSized(side, item.name);
    codeSized(side, item.type);
    codeSized(side, item.value);
  }
}
template void codeMetadata<ByteWriter>(ByteWriter&, const std::vector<MetaItem>&);
template void codeMetadata<ByteReader>(ByteReader&, std::vector<MetaItem>&);

template <class Side>
void codeChunk(Side& side, Coded<Side, ChunkRecord>& chunk) {
  codeCoord(side, chunk.origin);
  codeBox(side, chunk.box);
  code(side, chunk.count);
}
template void codeChunk<ByteWriter>(ByteWriter&, const ChunkRecord&);
template void codeChunk<ByteReader>(ByteReader&, ChunkRecord&);

void putGrid(ByteWriter& out, const StoredGrid& grid, const std::vector<ChunkRecord>& chunks) {
  codeFacts(out, grid);
  out.put(std::uint32_t(chunks.size()));
  if (chunks.size() == 1) codeChunk(out, chunks.front());
}

GridRecord getGrid(ByteReader& in) {
  GridRecord record;
  codeFacts(in, record.grid);
  code(in, record.chunkCount);
  if (record.chunkCount == 1) codeChunk(in, record.chunks.emplace_back());
  return record;
}

// ---- Differences of records

namespace {

std::vector<std::byte> recordOf(const StoredGrid& grid) {
  ByteWriter record;
  putGrid(record, grid, {});
  return record.take();
}

std::uint32_t equalBytes(std::span<const std::byte> a, std::span<const std::byte> b) {
  const auto end = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
  return std::uint32_t(end - a.begin());
}

std::uint32_t equalBytesAtEnd(std::span<const std::byte> a, std::span<const std::byte> b) {
  const auto end = std::mismatch(a.rbegin(), a.rend(), b.rbegin(), b.rend()).first;
  return std::uint32_t(end - a.rbegin());
}

/// Writes the bytes of a record between those that the previous record begins and ends with too.
void putRecord(ByteWriter& out, std::span<const std::byte> record,
               std::span<const std::byte> previous) {
  const std::uint32_t first = equalBytes(record, previous);
  const std::uint32_t last = equalBytesAtEnd(record.subspan(first), previous.subspan(first));
  out.put(first);
  out.put(last);
  out.putSized(record.subspan(first, record.size() - first - last));
}

std::vector<std::byte> getRecord(ByteReader& in, std::span<const std::byte> previous) {
  const auto first = in.get<std::uint32_t>(), last = in.get<std::uint32_t>();
  if (std::uint64_t(first) + last > previous.size())
    in.fail("more bytes of the previous frame's record than it has");
  const auto middle = in.getSized();
  std::vector<std::byte> record(previous.begin(), previous.begin() + first);
  record.insert(record.end(), middle.begin(), middle.end());
  record.insert(record.end(), previous.end() - last, previous.end());
  return record;
}

StoredGrid gridOf(std::span<const std::byte> record, const std::string& where) {
  ByteReader in(record, where);
  GridRecord grid = getGrid(in);
  in.finish();
  if (grid.chunkCount != 0) in.fail("the record has chunks");
  return std::move(grid.grid);
}

}  // namespace

void putRecordAfter(ByteWriter& out, const StoredGrid& grid, const StoredGrid& previous) {
  putRecord(out, recordOf(grid), recordOf(previous));
}

StoredGrid getRecordAfter(ByteReader& in, const StoredGrid& previous, const std::string& where) {
  return gridOf(getRecord(in, recordOf(previous)), where);
}

// ---- Carried grids

template <class Side>
void codeCarried(Side& side, Coded<Side, CarriedGrid>& grid) {
  codeSized(side, grid.name);
  codeSized(side, grid.treeType);
  codeFlag(side, grid.savedAsHalf, "mark of half floats");
  code(side, grid.vdbVersion);
  code(side, grid.place);
  code(side, grid.blocksAt);
}
template void codeCarried<ByteWriter>(ByteWriter&, const CarriedGrid&);
template void codeCarried<ByteReader>(ByteReader&, CarriedGrid&);

// ---- The curve of a fit

namespace {

constexpr std::size_t kPointBytes = 28;

/// A PSNR is infinite where the error is zero.
bool valid(const CurvePoint& p) {
  return std::isfinite(p.maxError) && !std::isnan(p.psnrBox) && !std::isnan(p.psnrActive);
}
constexpr const char* kInvalid = "a point of the curve is not a number";

/// Calls `visit` with each member of a point and a number of its type in the file, in the order of the file.
template <class Visit>
void forEachMember(Visit visit) {
  visit(&CurvePoint::ellipsoids, std::uint64_t{});
  visit(&CurvePoint::psnrBox, float{});
  visit(&CurvePoint::psnrActive, float{});
  visit(&CurvePoint::maxError, double{});
  visit(&CurvePoint::iteration, std::uint32_t{});
}

}  // namespace

std::vector<std::byte> putCurve(std::span<const CurvePoint> curve) {
  if (!std::all_of(curve.begin(), curve.end(), valid)) throw RuntimeFailure(kInvalid);
  ByteWriter out;
  forEachMember([&](auto member, auto stored) {
    for (const auto& point : curve) out.put(decltype(stored)(point.*member));
  });
  return out.take();
}

std::vector<CurvePoint> getCurve(std::span<const std::byte> content, const std::string& where) {
  ByteReader in(content, where);
  if (content.size() % kPointBytes != 0) in.fail("not a whole number of points");
  std::vector<CurvePoint> curve(content.size() / kPointBytes);
  forEachMember([&](auto member, auto stored) {
    for (auto& point : curve) point.*member = in.get<decltype(stored)>();
  });
  if (!std::all_of(curve.begin(), curve.end(), valid)) in.fail(kInvalid);
  return curve;
}

// ---- The errors of layers

namespace {

constexpr std::size_t kRecordBytes = 2 * sizeof(float);

}  // namespace

std::vector<std::byte> putLayerErrors(std::span<const LayerError> errors) {
  ByteWriter out;
  for (const LayerError& error : errors) {
    out.put(error.psnrBox);
    out.put(error.maxError);
  }
  return out.take();
}

std::vector<LayerError> getLayerErrors(std::span<const std::byte> content, std::size_t layers,
                                       const std::string& where) {
  ByteReader in(content, where);
  if (content.size() != layers * kRecordBytes)
    in.fail("not a table of " + counted(layers, "layer"));
  std::vector<LayerError> errors(layers);
  for (LayerError& error : errors) {
    error.psnrBox = in.get<float>();
    error.maxError = in.get<float>();
    if (std::isnan(error.psnrBox) || !std::isfinite(error.maxError))
      in.fail("the error of a layer is no number");
  }
  return errors;
}

// ---- All records in one section

namespace {

constexpr SectionId kJoined{SectionKind::kGridRecords};

std::vector<std::vector<std::byte>> getRecords(SectionReader& sections) {
  const std::uint64_t stored = sections.storedBytes(kJoined);
  const auto content = sections.get(kJoined);
  ByteReader in(content, sections.place(kJoined));
  std::vector<std::vector<std::byte>> records;
  while (in.left() > 0) {
    if (records.size() == stored) in.fail("more records than it has stored bytes");
    records.push_back(in.getBlob());
  }
  return records;
}

}  // namespace

std::vector<std::byte> putRecords(const std::vector<std::vector<std::byte>>& records) {
  ByteWriter out;
  for (const auto& record : records) out.putSized(record);
  return out.take();
}

GridRecords::GridRecords(SectionReader& sections)
    : sections_(sections), isJoined_(sections.has(kJoined)) {
  if (isJoined_) joined_ = getRecords(sections);
}

std::uint32_t GridRecords::count() const {
  return isJoined_ ? std::uint32_t(joined_.size()) : sections_.count(SectionKind::kGrid);
}

std::vector<std::byte> GridRecords::take(std::uint32_t grid) {
  if (!isJoined_) return sections_.get({SectionKind::kGrid, grid});
  if (next_ == joined_.size()) throw BadInput(place(grid) + ": there is no record of it");
  return std::move(joined_[next_++]);
}

std::string GridRecords::place(std::uint32_t grid) const {
  if (!isJoined_) return sections_.place({SectionKind::kGrid, grid});
  return sections_.place(kJoined) + ": grid " + std::to_string(grid);
}

// ---- The rules

namespace {

bool finite(double v) { return std::isfinite(v); }

bool allFinite(std::initializer_list<double> values) {
  return std::all_of(values.begin(), values.end(), finite);
}

bool validKernel(const Kernel& kernel) {
  return finite(kernel.kappa) && kernel.epsilon > 0.0f && kernel.epsilon < 1.0f;
}

bool validAffine(const Transform& transform) {
  return !transform.affine ||
         std::all_of(transform.affine->begin(), transform.affine->end(), finite);
}

/// What is wrong with the box voxels of a grid; null: nothing.
const char* boxVoxelFaultOf(const StoredGrid& grid) {
  const auto& voxels = grid.boxVoxels;
  if (voxels.empty()) return nullptr;
  if (grid.topology == TopologyKind::kMask) return "it has a mask and box voxels";
  if (voxels.size() > kMostBoxVoxels) return "it has more box voxels than a box has faces";
  if (!std::ranges::all_of(voxels, [&](Coord v) { return grid.activeBox.contains(v); }))
    return "a box voxel lies outside the bounding box";
  const bool isSorted =
      std::adjacent_find(voxels.begin(), voxels.end(), std::greater_equal<>()) == voxels.end();
  return isSorted ? nullptr : "its box voxels are not in order";
}

const char* toneFaultOf(const StoredGrid& grid) {
  if (grid.tone == ToneCurve{}) return nullptr;
  if (!finite(grid.tone.scale) || !grid.tone.isOn())
    return "the scale of its tone curve is not above 0";
  const bool isPlain = grid.field.background == 0.0f && grid.withinRange && !grid.farBackground;
  return isPlain ? nullptr : "a tone curve needs a background of 0 and values within their range";
}

std::optional<Fault> nonFinite(SectionKind section, const char* what,
                               std::span<const std::vector<float>> planes) {
  for (const auto& plane : planes) {
    const auto it = std::find_if_not(plane.begin(), plane.end(), finite);
    if (it != plane.end())
      return Fault{section, std::string(what) + " of ellipsoid " +
                                std::to_string(it - plane.begin()) + " is not finite"};
  }
  return std::nullopt;
}

std::optional<Fault> extremeScale(const std::array<std::vector<float>, 3>& logScale) {
  const auto extreme = [](float v) { return std::abs(v) > kMaxLogScale; };
  for (const auto& plane : logScale) {
    const auto it = std::find_if(plane.begin(), plane.end(), extreme);
    if (it != plane.end())
      return Fault{SectionKind::kScales, "a scale of ellipsoid " +
                                             std::to_string(it - plane.begin()) +
                                             " is not between e^-32 and e^32 voxels"};
  }
  return std::nullopt;
}

/// The bytes of OpenVDB's maps, which consist of vectors and of matrices of doubles. A frustum holds
/// another map, so that only its smallest size is known.
struct MapSize {
  std::string_view type;
  std::size_t bytes = 0;
};
constexpr std::size_t kVector = 3 * sizeof(double), kMatrix = 16 * sizeof(double);
constexpr std::array kMapSizes{MapSize{"UniformScaleMap", 5 * kVector},
                               MapSize{"ScaleMap", 5 * kVector},
                               MapSize{"TranslationMap", kVector},
                               MapSize{"UniformScaleTranslateMap", 6 * kVector},
                               MapSize{"ScaleTranslateMap", 6 * kVector},
                               MapSize{"UnitaryMap", kMatrix},
                               MapSize{"AffineMap", kMatrix}};
constexpr MapSize kFrustum{"NonlinearFrustumMap", 3 * kVector + kVector};

}  // namespace

std::optional<Fault> mapFaultOf(const Transform& transform) {
  const std::size_t bytes = transform.map.size();
  const auto known = std::ranges::find(kMapSizes, transform.mapType, &MapSize::type);
  const bool isGood = transform.mapType == kFrustum.type
                          ? bytes > kFrustum.bytes
                          : known == kMapSizes.end() || bytes == known->bytes;
  if (isGood) return std::nullopt;
  return Fault{SectionKind::kGrid, "the transform is damaged: " + std::to_string(bytes) +
                                       " bytes are not a map of type " + transform.mapType};
}

std::optional<Fault> faultOf(const StoredGrid& grid) {
  const auto fault = [](const char* text) { return Fault{SectionKind::kGrid, text}; };
  if (!allFinite({grid.descriptor.background, grid.field.background}))
    return fault("the background is not finite");
  if (!validAffine(grid.descriptor.transform)) return fault("the affine map is not finite");
  if (!validKernel(grid.field.kernel))
    return fault("the kernel's kappa is not finite or its epsilon not between 0 and 1");
  if (grid.farBackground && grid.topology != TopologyKind::kMask &&
      grid.topology != TopologyKind::kThreshold)
    return fault("a far background needs a mask or voxels");
  if (const char* text = toneFaultOf(grid)) return fault(text);
  if (!finite(grid.activeThreshold)) return fault("the threshold is not finite");
  if (const char* text = boxVoxelFaultOf(grid)) return fault(text);
  if (!allFinite({grid.valueMin, grid.valueMax}) || grid.valueMin > grid.valueMax)
    return fault("the range of values is not finite or empty");
  return std::nullopt;
}

std::optional<Fault> residualFaultOf(const StoredGrid& grid) {
  const auto fault = [](const char* text) { return Fault{SectionKind::kResidual, text}; };
  if (!grid.residual) return std::nullopt;
  if (grid.voxels) return fault("a residual to voxels that are stored themselves");
  if (grid.tone.isOn()) return fault("a residual to tones");
  if (grid.residual->form != VoxelForm::kQuantised)
    return fault("a residual that is not quantised");
  for (const BrickMask& mask : grid.residual->active)
    if (mask.count() != kBrickVoxels) return fault("a residual with voxels that are not active");
  return std::nullopt;
}

std::optional<Fault> faultOf(StoredComponents components) {
  const GridDescriptor& first = components.front().descriptor;
  for (const StoredGrid& component : components) {
    const GridDescriptor& d = component.descriptor;
    if (d.gridClass != first.gridClass || d.valueType != first.valueType ||
        d.transform != first.transform)
      return Fault{SectionKind::kVector, "its components differ in class, value type or transform"};
  }
  return std::nullopt;
}

std::optional<Fault> faultOf(const Ellipsoids& e) {
  if (auto f = nonFinite(SectionKind::kCenters, "the center", e.center)) return f;
  if (auto f = nonFinite(SectionKind::kScales, "a scale", e.logScale)) return f;
  if (auto f = extremeScale(e.logScale)) return f;
  if (auto f = nonFinite(SectionKind::kRotations, "the rotation", e.rotation)) return f;
  if (auto f = nonFinite(SectionKind::kIntensities, "the intensity", {&e.intensity, 1})) return f;
  if (auto f = nonFinite(SectionKind::kKappas, "the kappa", {&e.kappa, 1})) return f;
  if (!wellFormed(e)) return Fault{SectionKind::kRotations, "a quaternion is not of unit length"};
  return std::nullopt;
}

}  // namespace esvr::format
