#pragma once
/// The table that a run prints.

#include <iosfwd>

#include "vdb2esvr/options.h"
#include "vdb2esvr/run_record.h"

namespace esvr::vdb2esvr {

void printSummary(const Options& options, const RunRecord& record, std::ostream& out);

}  // namespace esvr::vdb2esvr
