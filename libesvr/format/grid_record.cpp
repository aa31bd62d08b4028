#include "format/grid_record.h"

namespace esvr::format {
namespace {

template <class Enum>
void putEnum(ByteWriter& out, Enum value) {
  out.put(static_cast<std::uint8_t>(value));
}

bool getBool(ByteReader& in, const char* what) {
  enum class Bool { kFalse, kTrue };
  return in.getEnum(Bool::kTrue, what) == Bool::kTrue;
}

void putCoord(ByteWriter& out, Coord c) {
  for (const auto v : {c.x, c.y, c.z}) out.put(v);
}
Coord getCoord(ByteReader& in) {
  Coord c;
  for (auto* v : {&c.x, &c.y, &c.z}) *v = in.get<std::int32_t>();
  return c;
}

void putBox(ByteWriter& out, const Box& box) {
  putCoord(out, box.min);
  putCoord(out, box.max);
}
Box getBox(ByteReader& in) {
  Box box;
  box.min = getCoord(in);
  box.max = getCoord(in);
  return box;
}

void putTransform(ByteWriter& out, const Transform& transform) {
  out.putSized(transform.mapType);
  out.putSized(transform.map);
  putEnum(out, transform.affine.has_value());
  if (transform.affine) out.putAll(*transform.affine);
}
Transform getTransform(ByteReader& in) {
  Transform transform;
  transform.mapType = in.getString();
  transform.map = in.getBlob();
  if (!getBool(in, "mark of an affine map")) return transform;
  transform.affine.emplace();
  for (double& m : *transform.affine) m = in.get<double>();
  return transform;
}

void putDescriptor(ByteWriter& out, const GridDescriptor& d) {
  out.putSized(d.name);
  putEnum(out, d.gridClass);
  putEnum(out, d.valueType);
  out.put(d.background);
  putTransform(out, d.transform);
  putMetadata(out, d.metadata);
}
GridDescriptor getDescriptor(ByteReader& in) {
  GridDescriptor d;
  d.name = in.getString();
  d.gridClass = in.getEnum(GridClass::kStaggered, "grid class");
  d.valueType = in.getEnum(ValueType::kDouble, "value type");
  d.background = in.get<double>();
  d.transform = getTransform(in);
  d.metadata = getMetadata(in);
  return d;
}

/// Added to the number of a topology if the grid has StoredGrid::farBackground.
constexpr std::uint8_t kFarBackground = 4;
enum class TopologyByte : std::uint8_t {
  kLast = std::uint8_t(TopologyKind::kBlocks) + kFarBackground
};

void putVoxelFacts(ByteWriter& out, const StoredGrid& grid) {
  out.put(std::uint8_t(std::uint8_t(grid.topology) + (grid.farBackground ? kFarBackground : 0)));
  putEnum(out, grid.withinRange);
  out.put(grid.activeThreshold);
  putBox(out, grid.activeBox);
  out.put(grid.activeVoxels);
  out.put(grid.valueMin);
  out.put(grid.valueMax);
}
void getVoxelFacts(ByteReader& in, StoredGrid& grid) {
  const auto topology = std::uint8_t(in.getEnum(TopologyByte::kLast, "topology"));
  grid.topology = TopologyKind(topology % kFarBackground);
  grid.farBackground = topology >= kFarBackground;
  grid.withinRange = getBool(in, "mark of a range of values");
  grid.activeThreshold = in.get<float>();
  grid.activeBox = getBox(in);
  grid.activeVoxels = in.get<std::uint64_t>();
  grid.valueMin = in.get<float>();
  grid.valueMax = in.get<float>();
}

void putKernel(ByteWriter& out, const Kernel& kernel) {
  putEnum(out, kernel.form);
  out.put(kernel.kappa);
  out.put(kernel.epsilon);
}
Kernel getKernel(ByteReader& in) {
  Kernel kernel;
  kernel.form = in.getEnum(KernelForm::kPaper, "kernel");
  kernel.kappa = in.get<float>();
  kernel.epsilon = in.get<float>();
  return kernel;
}

}  // namespace

void putMetadata(ByteWriter& out, const std::vector<MetaItem>& items) {
  out.put(std::uint32_t(items.size()));
  for (const auto& item : items) {
    out.putSized(item.name);
    out.putSized(item.type);
    out.putSized(item.value);
  }
}

std::vector<MetaItem> getMetadata(ByteReader& in) {
  std::vector<MetaItem> items;
  // Memory is not reserved for the stored count, because the count is checked only by reading the
  // items.
  for (auto left = in.get<std::uint32_t>(); left > 0; --left) {
    auto& item = items.emplace_back();
    item.name = in.getString();
    item.type = in.getString();
    item.value = in.getBlob();
  }
  return items;
}

void putChunk(ByteWriter& out, const ChunkRecord& chunk) {
  putCoord(out, chunk.origin);
  putBox(out, chunk.box);
  out.put(chunk.count);
}

ChunkRecord getChunk(ByteReader& in) {
  ChunkRecord chunk;
  chunk.origin = getCoord(in);
  chunk.box = getBox(in);
  chunk.count = in.get<std::uint64_t>();
  return chunk;
}

void putGrid(ByteWriter& out, const StoredGrid& grid, const std::vector<ChunkRecord>& chunks) {
  putDescriptor(out, grid.descriptor);
  putVoxelFacts(out, grid);
  out.put(grid.field.background);
  putKernel(out, grid.field.kernel);
  out.put(std::uint32_t(chunks.size()));
  if (chunks.size() == 1) putChunk(out, chunks.front());
}

GridRecord getGrid(ByteReader& in) {
  GridRecord record;
  record.grid.descriptor = getDescriptor(in);
  getVoxelFacts(in, record.grid);
  record.grid.field.background = in.get<float>();
  record.grid.field.kernel = getKernel(in);
  record.chunkCount = in.get<std::uint32_t>();
  if (record.chunkCount == 1) record.chunks.push_back(getChunk(in));
  return record;
}

}  // namespace esvr::format
