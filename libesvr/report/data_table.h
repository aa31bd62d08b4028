#pragma once
/// A table of figures on its way to a terminal, a page or a spreadsheet.

#include <string>
#include <variant>
#include <vector>

namespace esvr::report {

/// How a column's figures read.
enum class Kind {
  kText,
  kBytes,     ///< all digits
  kNumber,    ///< three significant digits
  kError,     ///< two significant digits
  kShare,     ///< four decimals
  kDecibels,  ///< two decimals; "exact" where infinite
  kSeconds,   ///< three significant digits
};

struct Column {
  std::string key;     ///< in CSV and JSON: "psnr_box"
  std::string header;  ///< for people: "PSNR box"
  Kind kind = Kind::kNumber;
};

/// Nothing where there is no figure.
using Cell = std::variant<std::monostate, double, std::string>;
using Row = std::vector<Cell>;

/// Rows are as long as `columns`.
struct DataTable {
  std::string title;
  std::vector<Column> columns;
  std::vector<Row> rows;
};

/// As people read it; "-" where there is none.
[[nodiscard]] std::string cellText(const Column& column, const Cell& cell);

/// All digits, "inf" for what is infinite, nothing where there is none.
[[nodiscard]] std::string exactText(const Cell& cell);

/// The columns of these keys, in their order. \throws std::logic_error  no such column
[[nodiscard]] DataTable withColumns(const DataTable& table, const std::vector<std::string>& keys);

/// Comma-separated values (RFC 4180): a line of keys, then the rows.
[[nodiscard]] std::string toCsv(const DataTable& table);

/// A GitHub table under a heading.
[[nodiscard]] std::string toMarkdown(const DataTable& table);

}  // namespace esvr::report
