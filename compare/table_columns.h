#pragma once
/// The columns of a table, and the rows as cells.

#include <span>

#include "compare/table_record.h"
#include "report/data_table.h"

namespace esvr::compare {

/// Which figures are better.
enum class Better { kNeither, kLess, kMore };

/// A column and the function that gets its figure from a row.
struct TableColumn {
  report::Column column;
  report::Cell (*of)(const TableRow&, const TableRecord&);
  Better better = Better::kNeither;
};

[[nodiscard]] const std::vector<TableColumn>& tableColumns();

/// Whether a figure of a column is better than another one. Figures that look the same are equally
/// good.
[[nodiscard]] bool isBetter(const TableColumn& column, const report::Cell& cell,
                            const report::Cell& than);
/// Whether the figures of a column say only how large a file is.
[[nodiscard]] bool isSize(const TableColumn& column);

/// The cells of all columns.
[[nodiscard]] report::Row cellsOf(const TableRow& row, const TableRecord& record);
/// The rows with all columns.
[[nodiscard]] report::DataTable dataTable(const TableRecord& record,
                                          std::span<const TableRow> rows);

/// The columns for which at least one row has a figure.
[[nodiscard]] report::DataTable withoutEmptyColumns(const report::DataTable& table);

}  // namespace esvr::compare
