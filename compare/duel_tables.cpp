#include "compare/duel_tables.h"

#include <algorithm>
#include <cmath>

#include "compare/table_columns.h"
#include "report/html_page.h"
#include "report/html_table.h"
#include "report/units.h"

namespace esvr::compare {
namespace {

using report::Cell;
using report::DataTable;
using report::FigureTable;
using report::Html;
using report::Kind;

/// The figures of a duel, one in a line. Sizes say something only where both have no error.
Html duelTable(const Duel& duel, const TableRecord& record) {
  const bool ofOneSize = std::isfinite(duel.ours->metrics->psnrBox);
  FigureTable figures{.sortable = false};
  DataTable& table = figures.table;
  table.columns = {
      {"figure", "figure", Kind::kText}, {"ours", duel.ours->name}, {"rival", duel.rival->name}};
  table.title = "The better figures are bold.";
  for (const auto& column : tableColumns()) {
    const Cell ours = column.of(*duel.ours, record), rival = column.of(*duel.rival, record);
    if (column.better == Better::kNeither || report::exactText(ours).empty()) continue;
    const bool counts = !(ofOneSize && isSize(column));
    if (counts && isBetter(column, ours, rival)) figures.best.push_back({table.rows.size(), 1});
    if (counts && isBetter(column, rival, ours)) figures.best.push_back({table.rows.size(), 2});
    table.rows.push_back(
        {column.column.meaning, cellText(column.column, ours), cellText(column.column, rival)});
  }
  return report::toHtml(figures);
}

/// The PSNR of ESVR and of its best rivals, a line for each file of ESVR.
Html duelsTable(const std::vector<Duel>& duels) {
  FigureTable figures{.sortable = false};
  DataTable& table = figures.table;
  table.title =
      "PSNR over the box in dB: that of ESVR, that of its best rival, and the lead of ESVR.";
  table.columns = {{"size", "size", Kind::kText, "size of the file of ESVR"},
                   {"ours", "ESVR", Kind::kDecibels, "PSNR of ESVR, dB"},
                   {"name", "best rival", Kind::kText},
                   {"rival", "PSNR", Kind::kDecibels, "PSNR of the best rival, dB"},
                   {"lead", "lead", Kind::kDecibels, "difference of both, dB"}};
  for (const Duel& duel : duels) {
    report::Row cells{report::bytesText(double(*duel.ours->bytes)), duel.ours->metrics->psnrBox,
                      std::string("none"), Cell(), Cell()};
    if (duel.rival) {
      cells[2] = duel.rival->name;
      cells[3] = duel.rival->metrics->psnrBox;
      if (std::isfinite(leadOf(duel))) cells[4] = leadOf(duel);
    }
    table.rows.push_back(std::move(cells));
  }
  return report::toHtml(figures);
}

}  // namespace

Html duelSection(const std::vector<Duel>& duels, const TableRecord& record) {
  const auto hasRival = [](const Duel& duel) { return duel.rival != nullptr; };
  if (std::none_of(duels.begin(), duels.end(), hasRival)) return {};
  if (duels.size() > 1)
    return report::section("duels", "ESVR and its best rivals", duelsTable(duels));
  return report::section("duel", "ESVR and its best rival", duelTable(duels.front(), record));
}

}  // namespace esvr::compare
