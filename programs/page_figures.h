#pragma once
/// Tables of figures, and pages in HTML. Pages are self-contained: a page needs no other file and no network. It can be read
/// without its script, in light and dark colors, on narrow and wide screens, and shows tables of figures, charts, pictures and maps of their errors.

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "esvr/image.h"

namespace esvr::report {

// ---- Tables of figures as text, Markdown or comma-separated values, and texts of single figures

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

// ---- Pages

/// Base64 (RFC 4648), for pictures within a page.
[[nodiscard]] std::string base64(std::string_view bytes);

/// Text of unknown origin for HTML and XML: markup characters become entities, and it is replaced what shownText() (esvr/grid.h)
/// replaces, but for line feeds.
[[nodiscard]] std::string escaped(std::string_view text);

// Pieces of HTML in which all texts and values of attributes are escaped.

struct Html {
  std::string markup{};

  Html& operator+=(const Html& after);
};

struct Attribute {
  const char* name;
  std::string value{};
};
using Attributes = std::vector<Attribute>;

[[nodiscard]] Html htmlText(std::string_view text);

/// An element with its content. Elements of blocks end with a line feed.
[[nodiscard]] Html element(const char* name, const Attributes& attributes, const Html& content);
[[nodiscard]] Html element(const char* name, const Attributes& attributes, std::string_view text);
[[nodiscard]] Html element(const char* name, std::string_view text);

/// An element that has no content and no end: img, input.
[[nodiscard]] Html voidElement(const char* name, const Attributes& attributes);

// Whole pages.

/// What a page says.
struct HtmlPage {
  std::string title{};                    ///< names the subject of the page
  std::string finding{};                  ///< its headline; if it is empty, the title is
  std::vector<std::string> paragraphs{};  ///< empty ones are left out
  std::vector<Html> sections{};
  std::vector<std::string> commands{};  ///< and versions: a line each
};

/// The page as HTML 5 in UTF-8.
[[nodiscard]] std::string toHtml(const HtmlPage& page);

/// A part of a page under a heading. `kind` is its class in page.css.
[[nodiscard]] Html section(const char* kind, const std::string& heading, const Html& content);

// The style and the script of pages, which render/page/build.mjs bundles.

[[nodiscard]] std::string_view pageStyle();
[[nodiscard]] std::string_view pageScript();

// ---- Figures

/// How rows, curves and pictures stand out.
enum class Emphasis { kNone, kOurs, kRival };

/// The class in page.css; empty for kNone.
[[nodiscard]] inline const char* classOf(Emphasis emphasis) {
  return emphasis == Emphasis::kOurs ? "ours" : emphasis == Emphasis::kRival ? "rival" : "";
}

// Tables.

struct CellPlace {
  std::size_t row = 0, column = 0;
  friend bool operator==(const CellPlace&, const CellPlace&) = default;
};

struct FigureTable {
  /// Consecutive rows under a heading.
  struct Group {
    std::string heading;
    std::size_t rows = 0;
  };

  DataTable table{};                  ///< its title is the caption; the first column names the row
  std::vector<std::string> folded{};  ///< keys of columns whose figures are folded below their row
  std::string reason{};               ///< key of the column that says why a row has no figures
  std::vector<Group> groups{};        ///< groups of all rows; if there are none, rows follow on
  std::vector<Emphasis> emphasis{};   ///< of each row, or nothing
  std::vector<CellPlace> best{};      ///< cells that are the best of their group
  bool sortable = true;               ///< whether a click on a header sorts
};

/// Columns without a figure are left out. Every cell of a column of numbers has its number with all
/// digits in the attribute data-value, which is empty where there is none.
[[nodiscard]] Html toHtml(const FigureTable& figures);

// Charts, which the script of a page draws (charts.js) from the JSON that stands in the page.

struct Point {
  double x = 0.0, y = 0.0;
  std::string note{};  ///< more about the point, where it is read out
};

struct Series {
  std::string name;
  /// Those that are not finite, or not above 0 on a logarithmic axis, are passed over.
  std::vector<Point> points{};
  Emphasis emphasis = Emphasis::kNone;  ///< kOurs is drawn in front, with a thicker line
  bool joined = true;                   ///< whether a line joins the points, by increasing x
};

/// How the values of an axis are written.
enum class Unit { kNone, kBytes, kSeconds, kPercent };

struct ChartAxis {
  std::string label{};
  Unit unit = Unit::kNone;
  bool logarithmic = false;
};

struct Chart {
  std::string title{};
  ChartAxis x{}, y{};
  std::vector<Series> series{};
  /// Whether a second scale of y has the PSNR of errors, which are percentages of the peak.
  bool decibels = false;
};

[[nodiscard]] Html toHtml(const Chart& chart);

// Maps of the errors of pictures, and the scale that says what their colors mean.

/// The error with the last color; larger errors have this color too. The largest possible error of
/// a channel is 1.
inline constexpr double kMostError = 0.125;

/// Gives the pixels of a gray map their colors, from black to a light yellow. Colors change with
/// the square root of the error, so that small errors are seen.
/// \param map  errors as a share of kMostError, 0 to 1
void colorErrors(Image& map);

/// The scale of the colors, with ticks.
[[nodiscard]] Html errorScale();

// Pictures. All those of a page are enlarged and moved together.

/// A picture with its errors.
struct Shot {
  std::string name, figures{};  ///< caption: what it shows, and what was measured
  std::string png{};
  std::string errorPng{};  ///< in the colors of errorScale(); empty for the reference
  Emphasis emphasis = Emphasis::kNone;
};

struct PictureSheet {
  std::string caption{};
  Shot reference;
  std::vector<Shot> shots{};   ///< those of kOurs are also shown in halves with the reference
  std::vector<Shot> others{};  ///< are folded
};

[[nodiscard]] Html toHtml(const PictureSheet& sheet);

}  // namespace esvr::report
