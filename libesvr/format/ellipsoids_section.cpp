#include "format/ellipsoids_section.h"

#include <algorithm>
#include <cmath>

#include "esvr/container.h"
#include "esvr/error.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"
#include "format/ellipsoid_block.h"

namespace esvr::format {
namespace {

/// Alike ellipsoids cost next to nothing, and a reader must know how many a byte can hold before it
/// allocates: the writer adds zeros where there would be more.
constexpr std::uint64_t kMostEllipsoidsAByte = 64;

constexpr std::uint64_t kBlockEntryBytes = kStreams * sizeof(std::uint32_t);
constexpr int kMostOffset = 1 << 20;  // of bit counts, in 1/256 bit: keeps sums in 32 bits
constexpr int kMostSlope = 1 << 12;

std::vector<Run> runsOf(std::size_t count) {
  std::vector<Run> runs;
  for (std::size_t first = 0; first < count; first += kBlockEllipsoids)
    runs.push_back({first, std::min(kBlockEllipsoids, count - first)});
  return runs;
}

std::vector<BlockStreams> encodeBlocks(QuantisedEllipsoids q) {
  std::vector<BlockStreams> blocks;
  for (const Run run : runsOf(q.size())) blocks.push_back(encodeBlock(q, run));
  return blocks;
}

void putLattice(ByteWriter& out, const Lattice& l) {
  out.put(l.cell);
  for (const auto low : {l.lowestCell.x, l.lowestCell.y, l.lowestCell.z}) out.put(low);
  out.put(l.scaleStep);
  out.put(l.lowestScale);
  out.put(l.intensityStep);
  for (const int n : {l.positionBase, l.positionSlope, l.scaleOffset, l.intensityBase,
                      l.intensitySlope, l.rotationOffset})
    out.put(std::int32_t(n));
  out.put(std::uint8_t(l.cellBits));
  out.put(std::uint8_t(l.signedIntensity));
  out.put(std::uint8_t(l.rotationFrom.size()));
  out.putAll(l.rotationFrom);
}

int getWithin(ByteReader& in, int most, const char* what) {
  const auto n = in.get<std::int32_t>();
  if (n < -most || n > most) in.fail(std::string(what) + " of the lattice is out of range");
  return n;
}

double getStep(ByteReader& in, const char* what) {
  const auto step = in.get<double>();
  if (!(std::isfinite(step) && step > 0.0))
    in.fail(std::string(what) + " of the lattice is not a positive number");
  return step;
}

Lattice getLattice(ByteReader& in) {
  Lattice l;
  l.cell = getStep(in, "the cell");
  l.lowestCell.x = in.get<std::int32_t>();
  l.lowestCell.y = in.get<std::int32_t>();
  l.lowestCell.z = in.get<std::int32_t>();
  l.scaleStep = getStep(in, "the step of scales");
  l.lowestScale = in.get<std::int32_t>();
  l.intensityStep = getStep(in, "the step of intensities");
  l.positionBase = getWithin(in, kMostOffset, "the base of positions");
  l.positionSlope = getWithin(in, kMostSlope, "the slope of positions");
  l.scaleOffset = getWithin(in, kMostOffset, "the offset of scales");
  l.intensityBase = getWithin(in, kMostOffset, "the base of intensities");
  l.intensitySlope = getWithin(in, kMostSlope, "the slope of intensities");
  l.rotationOffset = getWithin(in, kMostOffset, "the offset of rotations");
  l.cellBits = in.get<std::uint8_t>();
  if (l.cellBits > Lattice::kMaxCellBits) in.fail("the lattice has too many cells");
  l.signedIntensity = in.getEnum(std::uint8_t{1}, "mark of signs") != 0;
  l.rotationFrom.resize(in.get<std::uint8_t>());
  for (auto& from : l.rotationFrom) from = in.get<std::uint8_t>();
  return l;
}

std::vector<std::array<std::uint32_t, kStreams>> getBlockTable(ByteReader& in, std::size_t blocks) {
  if (in.left() / kBlockEntryBytes < blocks) in.fail("ends within the table of blocks");
  std::vector<std::array<std::uint32_t, kStreams>> table(blocks);
  for (auto& sizes : table)
    for (auto& size : sizes) size = in.get<std::uint32_t>();
  return table;
}

void decodeBlocks(ByteReader& in, QuantisedEllipsoids& q) {
  const auto runs = runsOf(q.size());
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
  out.padTo(std::max(out.size(), (q.size() + kMostEllipsoidsAByte - 1) / kMostEllipsoidsAByte));
  return out.take();
}

QuantisedEllipsoids getEllipsoids(std::span<const std::byte> content, std::uint64_t count,
                                  const std::string& where) {
  ByteReader in(content, where);
  const auto stored = in.get<std::uint64_t>();
  if (stored != count || count / kMostEllipsoidsAByte > content.size())
    in.fail(std::to_string(content.size()) + " bytes of content with " + std::to_string(stored) +
            " ellipsoids for " + std::to_string(count));
  QuantisedEllipsoids q;
  q.lattice = getLattice(in);
  q.resize(count);
  decodeBlocks(in, q);
  in.finishZeros();
  return q;
}

}  // namespace esvr::format

namespace esvr {

StreamBytes streamBytes(const EncodedGrid& grid) {
  StreamBytes bytes;
  for (const auto& chunk : grid.quantised) {
    for (const auto& block : format::encodeBlocks(chunk)) {
      bytes.positions += block[0].size();
      bytes.scales += block[1].size();
      bytes.rotations += block[2].size();
      bytes.intensities += block[3].size();
    }
  }
  return bytes;
}

}  // namespace esvr
