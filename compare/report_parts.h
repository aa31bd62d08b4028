#pragma once
/// What the reports of `table` and `curves` are made of: columns, sentences, tables of duels and
/// charts of errors.

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "compare/finding.h"
#include "compare/table_record.h"
#include "programs/data_table.h"
#include "programs/page_figures.h"

namespace esvr::compare {

/// The grid, its voxels, the box and the peak.
[[nodiscard]] std::string sceneLine(const TableRecord& record);
/// The device that drew the pictures and the cost of the reference's; empty without pictures.
[[nodiscard]] std::string pictureLine(const TableRecord& record);
/// Which rows are rivals (finding.h).
[[nodiscard]] std::string rivalRule();
/// Whether rows are missing; empty if not.
[[nodiscard]] std::string interruption(const TableRecord& record);

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

/// Adds a cell to an object of JSON; an empty one is left out.
void addCell(const report::Column& column, const report::Cell& cell, nlohmann::ordered_json& json);

/// A page with its title, its finding, and the command and the versions that made it.
[[nodiscard]] report::HtmlPage pageOf(const TableOptions& options, const TableRecord& record);

/// The columns for which at least one row has a figure.
[[nodiscard]] report::DataTable withoutEmptyColumns(const report::DataTable& table);

/// A section with all figures of one duel, or with the PSNR of several; nothing if no row has a
/// rival.
[[nodiscard]] report::Html duelSection(const std::vector<Duel>& duels, const TableRecord& record);

/// A chart of errors on logarithmic axes, without series. Its axis has the root mean square error over the
/// box as a share of the peak, and PSNR as a second scale. \param title  the title of the chart
[[nodiscard]] report::Chart errorOverBytes(const std::string& title);
[[nodiscard]] report::Chart errorOverSeconds(const std::string& title);

/// A point of such a chart. Where there is no error, the point is not shown.
/// \param x     bytes or seconds
/// \param psnr  dB over the box
/// \param note  what to say about the point besides its values
[[nodiscard]] report::Point errorPoint(double x, double psnr, const std::string& note = {});

/// The families of all rows (ESVR, OpenVDB, NanoVDB, ZFP, ...) over the size of their files.
[[nodiscard]] report::Chart familiesOverBytes(const TableRecord& record);

}  // namespace esvr::compare
