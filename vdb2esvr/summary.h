#pragma once
/// The tables that a run and a sequence print.

#include <iosfwd>

#include "vdb2esvr/options.h"
#include "vdb2esvr/records.h"

namespace esvr::vdb2esvr {

void printSummary(const Options& options, const RunRecord& record, std::ostream& out);

/// Prints a row for each frame, the range of PSNR of each grid, and the bytes in all.
void printSequence(const Options& options, const SequenceRecord& record, std::ostream& out);

}  // namespace esvr::vdb2esvr
