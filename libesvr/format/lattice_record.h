#pragma once
/// The quantisation lattice of a chunk's ellipsoids as bytes.

#include "esvr/quantised.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {

void putLattice(ByteWriter& out, const Lattice& lattice);

/// \throws BadInput  a step is not positive, or a number of bits is out of range
[[nodiscard]] Lattice getLattice(ByteReader& in);

}  // namespace esvr::format
