#pragma once
/// A table as a page.

#include <string>

#include "compare/table_options.h"
#include "compare/table_record.h"

namespace esvr::compare {

/// The page as HTML. Rows of ESVR stand beside the rows of their size, and so stand out together
/// with their best rivals.
[[nodiscard]] std::string tablePage(const TableOptions& options, const TableRecord& record);

}  // namespace esvr::compare
