// The sections of a chunk's ellipsoids.

#include "format/ellipsoid_sections.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <utility>

#include "core/counted.h"
#include "core/geometry.h"
#include "esvr/error.h"

namespace esvr::format {

// ---- Exact ellipsoids

namespace {

constexpr std::array<float, 4> kIdentity{1.0f, 0.0f, 0.0f, 0.0f};

/// Compares bits, so that negative zero is stored as such and not taken for zero.
bool sameBits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

}  // namespace

std::vector<std::byte> putPlanes(std::span<const Plane> planes) {
  ByteWriter out;
  for (const auto& plane : planes) out.putAll(plane);
  return out.take();
}

void getPlanes(std::span<const std::byte> content, std::uint64_t count, std::span<Plane> planes,
               const std::string& where) {
  const std::uint64_t perEllipsoid = planes.size() * sizeof(float);
  if (content.size() % perEllipsoid != 0 || content.size() / perEllipsoid != count)
    throw BadInput(where + ": " + counted(content.size(), "byte") + " of content for " +
                   counted(count, "ellipsoid"));
  for (auto& plane : planes) {
    plane.resize(count);
    if (count != 0) std::memcpy(plane.data(), content.data(), count * sizeof(float));
    content = content.subspan(count * sizeof(float));
  }
}

bool allIdentity(const std::array<Plane, 4>& rotation) {
  for (std::size_t c = 0; c < rotation.size(); ++c) {
    const auto differs = [c](float q) { return !sameBits(q, kIdentity[c]); };
    if (std::any_of(rotation[c].begin(), rotation[c].end(), differs)) return false;
  }
  return true;
}

void setIdentity(std::array<Plane, 4>& rotation, std::size_t count) {
  for (std::size_t c = 0; c < rotation.size(); ++c) rotation[c].assign(count, kIdentity[c]);
}

// ---- Quantised ellipsoids

namespace {

constexpr std::uint64_t kTableEntryBytes = kStreams * sizeof(std::uint32_t);

std::vector<std::array<std::uint32_t, kStreams>> getBlockTable(ByteReader& in, std::size_t blocks) {
  if (in.left() / kTableEntryBytes < blocks) in.fail("ends within the table of blocks");
  std::vector<std::array<std::uint32_t, kStreams>> table(blocks);
  for (auto& sizes : table)
    for (auto& size : sizes) size = in.get<std::uint32_t>();
  return table;
}

void decodeBlocks(ByteReader& in, QuantisedEllipsoids& q) {
  const auto runs = blockRuns(q);
  const auto table = getBlockTable(in, runs.size());
  for (std::size_t b = 0; b < runs.size(); ++b) {
    BlockBytes streams;
    for (std::size_t s = 0; s < kStreams; ++s) streams[s] = in.getBytes(table[b][s]);
    try {
      decodeBlock(streams, runs[b], q);
    } catch (const BadInput& error) {
      in.fail("block " + std::to_string(b) + ": " + error.what());
    }
  }
}

}  // namespace

std::vector<std::byte> putEllipsoids(const QuantisedEllipsoids& q) {
  ByteWriter out;
  out.put(std::uint64_t(q.size()));
  putLattice(out, q.lattice);
  const auto blocks = encodeBlocks(q);
  for (const auto& block : blocks)
    for (const auto& stream : block) out.put(std::uint32_t(stream.size()));
  for (const auto& block : blocks)
    for (const auto& stream : block) out.putAll(stream);
  padForEllipsoids(out, q.size());
  return out.take();
}

QuantisedEllipsoids getEllipsoids(std::span<const std::byte> content, std::uint64_t count,
                                  const std::string& where) {
  ByteReader in(content, where);
  const auto stored = in.get<std::uint64_t>();
  checkCount(in, stored, count, content.size());
  QuantisedEllipsoids q;
  q.lattice = getLattice(in);
  q.resize(count);
  decodeBlocks(in, q);
  in.finishZeros();
  return q;
}

// ---- Importance layers

namespace {

constexpr std::size_t kMaxLayers = 255;
constexpr std::uint64_t kBoxBytes = 6;
constexpr std::uint64_t kBlockEntryBytes =
    kBoxBytes + kStreams * sizeof(std::uint32_t) + sizeof(std::uint64_t);
constexpr std::uint64_t kChecksumBytes = sizeof(std::uint64_t);

constexpr std::int64_t kParts = 256;  // divisions of a chunk's box along an axis

/// Writes a block's box in 256ths of its chunk's box, rounded outwards.
void putBox(ByteWriter& out, const Box& box, const Box& chunk) {
  for (const auto axis : kAxes) {
    const std::int64_t low = chunk.min.*axis, side = std::int64_t(chunk.max.*axis) - low + 1;
    out.put(std::uint8_t((box.min.*axis - low) * kParts / side));
    out.put(std::uint8_t((box.max.*axis - low) * kParts / side));
  }
}

Box getBox(ByteReader& in, const Box& chunk) {
  Box box;
  for (const auto axis : kAxes) {
    const std::int64_t low = chunk.min.*axis, side = std::int64_t(chunk.max.*axis) - low + 1;
    const std::int64_t first = in.get<std::uint8_t>(), last = in.get<std::uint8_t>();
    if (first > last) in.fail("the box of a block is empty");
    box.min.*axis = std::int32_t(low + first * side / kParts);
    box.max.*axis = std::int32_t(low + ((last + 1) * side + kParts - 1) / kParts - 1);
  }
  return box;
}

std::vector<std::byte> joined(const BlockStreams& streams) {
  std::vector<std::byte> bytes;
  for (const auto& stream : streams) bytes.insert(bytes.end(), stream.begin(), stream.end());
  return bytes;
}

/// The directory without its own size before it and its checksum behind it.
std::vector<std::byte> putDirectory(const QuantisedEllipsoids& q, const Box& chunk,
                                    std::span<const Box> boxes,
                                    std::span<const BlockStreams> blocks) {
  ByteWriter out;
  out.put(std::uint64_t(q.size()));
  putLattice(out, q.lattice);
  out.put(std::uint8_t(q.layerEnds.size()));
  for (const std::size_t end : q.layerEnds) out.put(std::uint64_t(end));
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    putBox(out, boxes[b], chunk);
    for (const auto& stream : blocks[b]) out.put(std::uint32_t(stream.size()));
    out.put(checksum(joined(blocks[b])));
  }
  return out.take();
}

std::vector<std::size_t> getLayerEnds(ByteReader& in, std::uint64_t count) {
  std::vector<std::size_t> ends(in.get<std::uint8_t>());
  std::size_t last = 0;
  for (auto& end : ends) {
    end = in.get<std::uint64_t>();
    if (end <= last || end > count) in.fail("a layer is empty or beyond the chunk");
    last = end;
  }
  if (ends.size() < 2 || last != count) in.fail("the layers are not those of the chunk");
  return ends;
}

std::size_t layerOf(const std::vector<std::size_t>& ends, std::size_t i) {
  return std::size_t(std::upper_bound(ends.begin(), ends.end(), i) - ends.begin());
}

/// Reads the entries of the directory. \param offset  position of the first block in the section
std::vector<BlockEntry> getEntries(ByteReader& in, const BlockDirectory& directory,
                                   const ChunkRecord& chunk, std::uint64_t offset) {
  const auto runs = blockRuns(chunk.count, directory.layerEnds);
  if (in.left() != runs.size() * kBlockEntryBytes) in.fail("not a directory of these blocks");
  std::vector<BlockEntry> entries;
  for (const Run run : runs) {
    BlockEntry entry{run, layerOf(directory.layerEnds, run.first), getBox(in, chunk.box)};
    for (auto& size : entry.bytes) size = in.get<std::uint32_t>();
    entry.checksum = in.get<std::uint64_t>();
    entry.offset = offset;
    offset += entry.size();
    entries.push_back(entry);
  }
  return entries;
}

/// Reads the directory and checks its checksum. \return the bytes between its size and its checksum
std::vector<std::byte> readDirectory(const ByteSource& section) {
  constexpr std::uint64_t kSizeBytes = sizeof(std::uint32_t);
  auto bytes = section.read(0, kSizeBytes);
  const std::uint64_t size = ByteReader(bytes, section.name()).get<std::uint32_t>();
  if (size > section.size() || size < kSizeBytes + kChecksumBytes)
    throw BadInput(section.name() + ": a directory of " + std::to_string(size) + " bytes in " +
                   std::to_string(section.size()));
  const auto rest = section.read(kSizeBytes, size - kSizeBytes);
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  const auto covered = std::span(bytes).first(size - kChecksumBytes);
  const auto stored = std::span(bytes).last(kChecksumBytes);
  if (ByteReader(stored, section.name()).get<std::uint64_t>() != checksum(covered))
    throw BadInput(section.name() + ": checksum of the directory does not match");
  return {covered.begin() + kSizeBytes, covered.end()};
}

void checkInside(const ByteSource& section, const BlockDirectory& directory) {
  const BlockEntry& last = directory.blocks.back();
  if (last.offset + last.size() > section.size())
    throw BadInput(section.name() + ": the blocks do not lie in the section");
}

std::vector<std::byte> readBlock(const ByteSource& section, const BlockEntry& entry) {
  auto bytes = section.read(entry.offset, entry.size());
  if (checksum(bytes) != entry.checksum)
    throw BadInput(section.name() + ": checksum of a block does not match");
  return bytes;
}

void decodeInto(std::span<const std::byte> bytes, const BlockEntry& entry, Run run,
                QuantisedEllipsoids& q) {
  BlockBytes streams;
  for (std::size_t s = 0; s < kStreams; ++s) {
    streams[s] = bytes.first(entry.bytes[s]);
    bytes = bytes.subspan(entry.bytes[s]);
  }
  decodeBlock(streams, run, q);
}

/// The ends of the layers of the chosen blocks; empty if they are of one layer.
std::vector<std::size_t> endsOf(const BlockDirectory& directory,
                                std::span<const std::size_t> chosen) {
  std::vector<std::size_t> ends;
  std::size_t at = 0;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const BlockEntry& entry = directory.blocks[chosen[k]];
    at += entry.run.count;
    const bool last = k + 1 == chosen.size();
    if (last || directory.blocks[chosen[k + 1]].layer != entry.layer) ends.push_back(at);
  }
  if (ends.size() < 2) ends.clear();
  return ends;
}

}  // namespace

std::uint64_t BlockEntry::size() const {
  return std::accumulate(bytes.begin(), bytes.end(), std::uint64_t{0});
}

std::vector<std::byte> putLayered(const QuantisedEllipsoids& q, const Box& chunk,
                                  std::span<const Box> boxes) {
  if (q.layerEnds.size() > kMaxLayers) throw RuntimeFailure("too many importance layers");
  const auto blocks = encodeBlocks(q);
  const auto directory = putDirectory(q, chunk, boxes, blocks);
  ByteWriter out;
  out.put(std::uint32_t(sizeof(std::uint32_t) + directory.size() + kChecksumBytes));
  out.putAll(directory);
  out.put(checksum(out.bytes()));
  for (const auto& block : blocks) out.putAll(joined(block));
  padForEllipsoids(out, q.size());
  return out.take();
}

std::uint64_t storedBytes(const QuantisedEllipsoids& q) {
  if (q.layerEnds.empty()) return putEllipsoids(q).size();
  const Box any{{}, {}};  // the number of bytes does not depend on the boxes
  return putLayered(q, any, std::vector<Box>(blockRuns(q).size(), any)).size();
}

BlockDirectory getDirectory(const ByteSource& section, const ChunkRecord& chunk) {
  const auto bytes = readDirectory(section);
  ByteReader in(bytes, section.name());
  checkCount(in, in.get<std::uint64_t>(), chunk.count, section.size());
  if (chunk.box.empty()) in.fail("the chunk's box is empty");
  BlockDirectory directory;
  directory.lattice = getLattice(in);
  directory.layerEnds = getLayerEnds(in, chunk.count);
  directory.blocks =
      getEntries(in, directory, chunk, sizeof(std::uint32_t) + bytes.size() + kChecksumBytes);
  checkInside(section, directory);
  return directory;
}

QuantisedEllipsoids getBlocks(const ByteSource& section, const BlockDirectory& directory,
                              std::span<const std::size_t> chosen) {
  QuantisedEllipsoids q;
  q.lattice = directory.lattice;
  q.layerEnds = endsOf(directory, chosen);
  for (const std::size_t b : chosen) {
    const BlockEntry& entry = directory.blocks[b];
    const Run run{q.size(), entry.run.count};
    const auto bytes = readBlock(section, entry);
    q.resize(run.first + run.count);
    try {
      decodeInto(bytes, entry, run, q);
    } catch (const BadInput& error) {
      throw BadInput(section.name() + ": block " + std::to_string(b) + ": " + error.what());
    }
  }
  return q;
}

void checkEnd(const ByteSource& section, const BlockDirectory& directory) {
  const BlockEntry& last = directory.blocks.back();
  const std::uint64_t end = last.offset + last.size();
  const auto rest = section.read(end, section.size() - end);
  ByteReader(rest, section.name()).finishZeros();
}

}  // namespace esvr::format
