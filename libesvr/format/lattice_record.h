#pragma once
/// The lattice of a chunk's quantised ellipsoids as bytes.

#include "esvr/quantised.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {

void putLattice(ByteWriter& out, const Lattice& lattice);

/// \throws BadInput  steps that are not positive, numbers of bits out of range
[[nodiscard]] Lattice getLattice(ByteReader& in);

}  // namespace esvr::format
