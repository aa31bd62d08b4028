#pragma once
/// A table of figures as text, Markdown or comma-separated values, and texts of single figures.

#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace esvr::report {

// Short texts of figures with their units, for sentences.

/// Three significant digits without an exponent: "0.00012", "46.1", "258000".
[[nodiscard]] std::string plainText(double value);
/// A size in units of 1000: "800 B", "46.1 KB", "2.6 MB".
[[nodiscard]] std::string bytesText(double bytes);

/// The format of a column's figures.
enum class Kind {
  kText,
  kBytes,      ///< all digits
  kMegabytes,  ///< bytes in units of a million, three significant digits
  kNumber,     ///< three significant digits
  kError,      ///< two significant digits
  kShare,      ///< four decimals
  kDecibels,   ///< two decimals; "exact" where infinite
  kSeconds,    ///< three significant digits
};

struct Column {
  std::string key;     ///< name in CSV and JSON: "psnr_box"
  std::string header;  ///< name in tables for people: "PSNR box"
  Kind kind = Kind::kNumber;
  std::string meaning{};  ///< what the figure is, with its unit, where there is room for it
};

/// A figure or a text; nothing if there is no figure.
using Cell = std::variant<std::monostate, double, std::string>;
using Row = std::vector<Cell>;

/// A cell with a number, or an empty one.
[[nodiscard]] inline Cell cellOf(std::optional<double> value) {
  return value ? Cell(*value) : Cell();
}

/// A table whose rows have as many cells as there are columns.
struct DataTable {
  std::string title;
  std::vector<Column> columns;
  std::vector<Row> rows;
};

/// A cell in a form for people; "-" if there is no figure.
[[nodiscard]] std::string cellText(const Column& column, const Cell& cell);

/// A cell with all digits; "inf" if it is infinite, empty if there is no figure.
[[nodiscard]] std::string exactText(const Cell& cell);

/// A table of the columns with these keys, in the order of the keys.
/// \throws std::logic_error  a column does not exist
[[nodiscard]] DataTable withColumns(const DataTable& table, const std::vector<std::string>& keys);

/// The table as comma-separated values (RFC 4180): a line of keys, then the rows.
[[nodiscard]] std::string toCsv(const DataTable& table);

/// Text of unknown origin in one line of GitHub's Markdown, in which it has no markup.
[[nodiscard]] std::string markdownText(const std::string& text);

/// Text of unknown origin as a code span of Markdown.
[[nodiscard]] std::string markdownCode(const std::string& text);

/// The table in GitHub's Markdown, under a heading. Cells and headings are markdownText().
[[nodiscard]] std::string toMarkdown(const DataTable& table);

}  // namespace esvr::report
