#pragma once
/// The rows of a table as text, Markdown, CSV, JSON and HTML.

#include <iosfwd>

#include "compare/table.h"
#include "compare/table_record.h"

namespace esvr::compare {

/// Prints the table with at most 100 characters in a line, unless a name is longer.
/// \param search  whether the trials of the searches are printed
void printTable(const TableRecord& record, bool search, std::ostream& out);

/// Writes all wanted files. \throws RuntimeFailure  a file is not writable
void writeReports(const TableOptions& options, const TableRecord& record);

}  // namespace esvr::compare
