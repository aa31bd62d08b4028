#pragma once
/// The paper's tables, for any volume.

#include "compare/table_options.h"

namespace esvr::compare {

/// Prints the rows and writes the reports. \throws BadInput  what cannot be compared;
/// RuntimeFailure: interrupted, with the rows already made printed and written
void table(const TableOptions& options);

}  // namespace esvr::compare
