#include "format/continued_section.h"

#include <cstdlib>

#include "codec/continued_coder.h"
#include "codec/symbol_coder.h"
#include "esvr/error.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"
#include "format/ellipsoid_block.h"
#include "format/varint.h"

namespace esvr::format {
namespace {

/// Whether the cells of the lattice are those of the previous frame.
enum class Cells : std::uint8_t { kOwn = 0, kSame = 1 };

bool sameCells(const Lattice& a, const Lattice& b) {
  return a.lowestCell == b.lowestCell && a.cellBits == b.cellBits;
}

void putLattice(ByteWriter& out, const Lattice& lattice, const Lattice& before) {
  out.put(std::int8_t(*codec::refinementOf(lattice, before)));
  const bool same = sameCells(lattice, before);
  out.put(std::uint8_t(same ? Cells::kSame : Cells::kOwn));
  if (same) return;
  for (const auto low : {lattice.lowestCell.x, lattice.lowestCell.y, lattice.lowestCell.z})
    out.put(low);
  out.put(std::uint8_t(lattice.cellBits));
}

Lattice getLattice(ByteReader& in, const Lattice& before) {
  const int octaves = in.get<std::int8_t>();
  if (std::abs(octaves) > codec::kMaxRefinement)
    in.fail("the steps change by " + std::to_string(octaves) + " octaves");
  Lattice lattice = codec::refined(before, octaves);
  if (in.getEnum(Cells::kSame, "cells of a lattice") == Cells::kSame) return lattice;
  lattice.lowestCell.x = in.get<std::int32_t>();
  lattice.lowestCell.y = in.get<std::int32_t>();
  lattice.lowestCell.z = in.get<std::int32_t>();
  lattice.cellBits = in.get<std::uint8_t>();
  if (lattice.cellBits > Lattice::kMaxCellBits) in.fail("the lattice has too many cells");
  if (!codec::refinementOf(lattice, before)) in.fail("the cells lie too far from those before");
  return lattice;
}

/// The ellipsoids that continue none.
Run newOnes(const QuantisedEllipsoids& q) {
  return {q.continues.size(), q.size() - q.continues.size()};
}

void putNew(ByteWriter& out, QuantisedEllipsoids& q) {
  if (newOnes(q).count == 0) return;
  const BlockStreams streams = encodeBlock(q, newOnes(q));
  for (const auto& stream : streams) putVarint(out, stream.size());
  for (const auto& stream : streams) out.putAll(stream);
}

void getNew(ByteReader& in, QuantisedEllipsoids& q) {
  if (newOnes(q).count == 0) return;
  std::array<std::uint64_t, kStreams> sizes{};
  for (auto& size : sizes) size = getVarint(in);
  BlockBytes streams;
  for (std::size_t s = 0; s < kStreams; ++s) streams[s] = in.getBytes(sizes[s]);
  decodeBlock(streams, newOnes(q), q);
}

}  // namespace

bool canContinue(const QuantisedEllipsoids& q, const QuantisedEllipsoids& before) {
  const auto& from = q.continues;
  if (from.empty() || from.back() >= before.size() || from.size() > q.size()) return false;
  for (std::size_t i = 0; i < from.size(); ++i)
    if ((i > 0 && from[i] <= from[i - 1]) || q.precision[i] != before.precision[from[i]])
      return false;
  return codec::refinementOf(q.lattice, before.lattice).has_value();
}

std::vector<std::byte> putContinued(const QuantisedEllipsoids& q,
                                    const QuantisedEllipsoids& before) {
  QuantisedEllipsoids written = q;
  codec::Writer writer;
  codec::codeContinued(writer, before, written);
  const auto stream = writer.coder.finish();
  ByteWriter out;
  putLattice(out, q.lattice, before.lattice);
  putVarint(out, newOnes(q).count);
  putVarint(out, stream.size());
  out.putAll(stream);
  putNew(out, written);
  padForEllipsoids(out, newOnes(q).count);
  return out.take();
}

QuantisedEllipsoids getContinued(std::span<const std::byte> content, const std::string& where,
                                 const QuantisedEllipsoids& before, MemoryBudget& budget) {
  ByteReader in(content, where);
  QuantisedEllipsoids q;
  q.lattice = getLattice(in, before.lattice);
  const std::uint64_t added = getVarint(in);
  checkCount(in, added, added, content.size());
  budget.take(double(before.size() + added) * kDecodedBytesPerEllipsoid, where);
  try {
    codec::Reader reader{codec::RangeDecoder(in.getBytes(getVarint(in)))};
    codec::codeContinued(reader, before, q);
    q.resize(q.continues.size() + added);
    getNew(in, q);
  } catch (const BadInput& error) {
    in.fail(error.what());
  }
  in.finishZeros();
  return q;
}

}  // namespace esvr::format
