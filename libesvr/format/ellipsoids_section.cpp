#include "format/ellipsoids_section.h"

#include "esvr/error.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"
#include "format/ellipsoid_block.h"
#include "format/lattice_record.h"

namespace esvr::format {
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

}  // namespace esvr::format
