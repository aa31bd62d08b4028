#pragma once
/// esvr-compare table: the paper's tables for any volume.

#include "compare/table_options.h"

namespace esvr::compare {

/// Makes the rows, prints them and writes the reports.
/// \throws BadInput  the files cannot be compared
/// \throws RuntimeFailure  the run was interrupted; finished rows were printed and written
void table(const TableOptions& options);

}  // namespace esvr::compare
