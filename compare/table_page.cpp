#include "compare/table_page.h"

#include <algorithm>
#include <span>

#include "cli/table.h"
#include "compare/duel_tables.h"
#include "compare/error_chart.h"
#include "compare/finding.h"
#include "compare/page_order.h"
#include "compare/report_versions.h"
#include "compare/table_columns.h"
#include "compare/table_lines.h"
#include "report/chart.h"
#include "report/html_page.h"
#include "report/html_pictures.h"
#include "report/html_table.h"
#include "report/units.h"

namespace esvr::compare {
namespace {

using report::Emphasis;
using report::FigureTable;
using report::Html;

/// Columns whose figures are folded below their row.
const std::vector<std::string> kFolded{
    "group",        "setting",      "p999_error",   "mass_error",   "encode_min_s",
    "encode_max_s", "decode_min_s", "decode_max_s", "memory_bytes", "image_ssim",
    "device_bytes", "note",         "command"};

constexpr const char* kTableCaption =
    "Ratios are to the half-float Blosc VDB. Errors are in value units. The best figures of a "
    "group are bold.";

/// The cells of a column that are better than another one, and worse than none.
std::vector<std::size_t> bestRows(std::span<const report::Row> rows, std::size_t c) {
  const TableColumn& column = tableColumns()[c];
  const auto isAny = [&](const auto& test) { return std::any_of(rows.begin(), rows.end(), test); };
  std::vector<std::size_t> best;
  for (std::size_t r = 0; r < rows.size(); ++r)
    if (isAny([&](const auto& row) { return isBetter(column, rows[r][c], row[c]); }) &&
        !isAny([&](const auto& row) { return isBetter(column, row[c], rows[r][c]); }))
      best.push_back(r);
  return best;
}

/// Adds a group of rows. Where all rows were searched for one size, no size is the best.
void addGroup(const RowGroup& group, const TableRecord& record, FigureTable& figures) {
  auto& rows = figures.table.rows;
  const std::size_t begin = rows.size();
  for (const TableRow* row : group.rows) rows.push_back(cellsOf(*row, record));
  figures.groups.push_back({group.heading, group.rows.size()});
  for (std::size_t c = 0; c < tableColumns().size(); ++c)
    if (!group.ofOneSize || !isSize(tableColumns()[c]))
      for (const std::size_t r : bestRows(std::span(rows).subspan(begin), c))
        figures.best.push_back({begin + r, c});
}

Html allRows(const TableRecord& record, const PageOrder& order) {
  FigureTable figures{.table = dataTable(record, {}), .folded = kFolded, .reason = "note"};
  for (const auto& group : order.groups()) {
    addGroup(group, record, figures);
    for (const TableRow* row : group.rows) figures.emphasis.push_back(order.emphasisOf(*row));
  }
  figures.table.title = kTableCaption;
  return report::section("figures", "All rows", report::toHtml(figures));
}

Html overview(const TableRecord& record, const PageOrder& order) {
  Html content = duelSection(order.duels(), record);
  content += report::section("", "Error over size", report::toHtml(familiesOverBytes(record)));
  return report::element("div", {{"class", "overview"}}, content);
}

report::Shot shotOf(const TableRow& row, Emphasis emphasis) {
  const ImageFigures& figures = *row.images;
  std::string text = report::bytesText(double(row.bytes.value_or(0))) + ", PSNR of the pictures " +
                     cli::decibels(figures.psnr) + " dB, FLIP " + report::plainText(figures.flip);
  return {row.name, std::move(text), row.shown.picturePng, row.shown.errorPng, emphasis};
}

/// Whether a row is neither near ESVR in size nor in PSNR, so that its pictures say little.
bool isPlain(const TableRow& row) {
  return row.group == kLosslessGroup || row.group == kNearlyLosslessGroup ||
         row.group == kQuantisedGroup;
}

/// ESVR and its rivals first; the pictures of the other rows are folded.
Html pictures(const TableRecord& record, const PageOrder& order) {
  report::PictureSheet sheet{
      .caption = "The first view of each row, and its errors against the picture of the reference.",
      .reference = {.name = "reference", .png = record.referencePng}};
  for (const auto& group : order.groups())
    for (const TableRow* row : group.rows) {
      const Emphasis emphasis = order.emphasisOf(*row);
      if (!row->images || (emphasis == Emphasis::kNone && isPlain(*row))) continue;
      (emphasis == Emphasis::kNone ? sheet.others : sheet.shots).push_back(shotOf(*row, emphasis));
    }
  return report::toHtml(sheet);
}

}  // namespace

std::string tablePage(const TableOptions& options, const TableRecord& record) {
  const PageOrder order(record);
  report::HtmlPage page;
  page.title = options.reference.filename().string();
  page.finding = findingOf(record);
  page.paragraphs = {sceneLine(record) + ".", order.duels().empty() ? "" : rivalRule(),
                     pictureLine(record), interruption(record)};
  page.sections = {overview(record, order), allRows(record, order)};
  if (!record.referencePng.empty())
    page.sections.push_back(report::section("pictures", "Pictures", pictures(record, order)));
  page.commands = versionLines();
  page.commands.insert(page.commands.begin(), joined(options.commandLine));
  return report::toHtml(page);
}

}  // namespace esvr::compare
