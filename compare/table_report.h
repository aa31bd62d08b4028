#pragma once
/// A table's rows for a terminal, as Markdown, CSV, JSON and a page.

#include <iosfwd>

#include "compare/table_options.h"
#include "compare/table_record.h"

namespace esvr::compare {

/// Lines of 100 characters at most, names that long excepted. \param search  print it too
void printTable(const TableRecord& record, bool search, std::ostream& out);

/// All files that were asked for. \throws RuntimeFailure  not writable
void writeReports(const TableOptions& options, const TableRecord& record);

}  // namespace esvr::compare
