#pragma once
/// The table that a run over a sequence prints.

#include <iosfwd>

#include "vdb2esvr/options.h"
#include "vdb2esvr/sequence_record.h"

namespace esvr::vdb2esvr {

/// Prints a row for each frame, the range of PSNR of each grid, and the bytes in all.
void printSequence(const Options& options, const SequenceRecord& record, std::ostream& out);

}  // namespace esvr::vdb2esvr
