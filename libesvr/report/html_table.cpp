#include "report/html_table.h"

#include <algorithm>
#include <cmath>

namespace esvr::report {
namespace {

/// The number of a cell in the form that scripts read.
std::string numberOf(const Cell& cell) {
  const auto* value = std::get_if<double>(&cell);
  if (value && std::isinf(*value)) return *value > 0 ? "Infinity" : "-Infinity";
  return value ? exactText(cell) : "";
}

Attributes attributesOf(const Column& column, const Cell& cell) {
  if (column.kind == Kind::kText) return {{"class", "text"}};
  return {{"data-value", numberOf(cell)}};
}

const std::string& meaningOf(const Column& column) {
  return column.meaning.empty() ? column.header : column.meaning;
}

/// Writes the rows of a table.
class TableWriter {
 public:
  explicit TableWriter(const FigureTable& figures) : figures_(figures) {
    for (std::size_t c = 0; c < columns().size(); ++c)
      if (c == 0 || hasFigures(c)) (isFolded(columns()[c]) ? folded_ : shown_).push_back(c);
  }

  [[nodiscard]] Html table() const {
    Html content = element("caption", {}, element("span", {}, figures_.table.title));
    content += element("thead", {}, element("tr", {}, headers()));
    content += bodies();
    return element("table", {{"class", figures_.sortable ? "sortable" : ""}}, content);
  }

 private:
  [[nodiscard]] const std::vector<Column>& columns() const { return figures_.table.columns; }

  [[nodiscard]] bool hasFigures(std::size_t c) const {
    const auto& rows = figures_.table.rows;
    return std::any_of(rows.begin(), rows.end(),
                       [&](const Row& row) { return !exactText(row[c]).empty(); });
  }

  [[nodiscard]] bool isFolded(const Column& column) const {
    return std::count(figures_.folded.begin(), figures_.folded.end(), column.key) != 0;
  }

  [[nodiscard]] std::string width() const { return std::to_string(shown_.size()); }

  [[nodiscard]] Html headers() const {
    Html cells;
    for (const std::size_t c : shown_) {
      const Column& column = columns()[c];
      Attributes attributes{{"scope", "col"}, {"title", meaningOf(column)}};
      if (column.kind == Kind::kText) attributes.push_back({"class", "text"});
      cells += element("th", attributes, column.header);
    }
    return cells;
  }

  [[nodiscard]] Html bodies() const {
    if (figures_.groups.empty()) return element("tbody", {}, rows(0, figures_.table.rows.size()));
    Html all;
    std::size_t begin = 0;
    for (const auto& group : figures_.groups) {
      Html body = groupRow(group.heading);
      body += rows(begin, begin + group.rows);
      all += element("tbody", {}, body);
      begin += group.rows;
    }
    return all;
  }

  [[nodiscard]] Html groupRow(const std::string& heading) const {
    const Attributes attributes{{"scope", "rowgroup"}, {"colspan", width()}};
    return element("tr", {{"class", "group"}},
                   element("th", attributes, element("span", {}, heading)));
  }

  [[nodiscard]] Html rows(std::size_t begin, std::size_t end) const {
    Html all;
    for (std::size_t r = begin; r < end; ++r) {
      all += row(r);
      if (!folded_.empty()) all += foldedRow(r);
    }
    return all;
  }

  [[nodiscard]] Html row(std::size_t r) const {
    const Row& cells = figures_.table.rows[r];
    const Emphasis emphasis = r < figures_.emphasis.size() ? figures_.emphasis[r] : Emphasis::kNone;
    Html content = element("th", {{"scope", "row"}}, cellText(columns().front(), cells.front()));
    content += isEmpty(cells) ? reasonOf(cells) : figuresOf(r);
    return element("tr", {{"class", std::string("row ") + classOf(emphasis)}}, content);
  }

  [[nodiscard]] bool isEmpty(const Row& cells) const {
    return std::all_of(shown_.begin() + 1, shown_.end(),
                       [&](std::size_t c) { return exactText(cells[c]).empty(); });
  }

  [[nodiscard]] Html reasonOf(const Row& cells) const {
    std::string reason;
    for (std::size_t c = 0; c < columns().size(); ++c)
      if (columns()[c].key == figures_.reason) reason = exactText(cells[c]);
    return element("td", {{"class", "reason"}, {"colspan", std::to_string(shown_.size() - 1)}},
                   reason);
  }

  [[nodiscard]] Html figuresOf(std::size_t r) const {
    Html all;
    for (const std::size_t c : shown_)
      if (c != 0) all += cell("td", {r, c});
    return all;
  }

  [[nodiscard]] Html cell(const char* name, const CellPlace& at) const {
    const Column& column = columns()[at.column];
    const Cell& content = figures_.table.rows[at.row][at.column];
    Attributes attributes = attributesOf(column, content);
    if (std::count(figures_.best.begin(), figures_.best.end(), at) != 0)
      attributes.push_back({"class", "best"});
    return element(name, attributes, cellText(column, content));
  }

  [[nodiscard]] Html foldedRow(std::size_t r) const {
    Html list;
    for (const std::size_t c : folded_) {
      if (exactText(figures_.table.rows[r][c]).empty()) continue;
      Html pair = element("dt", meaningOf(columns()[c]));
      pair += cell("dd", {r, c});
      list += element("div", {}, pair);
    }
    return element("tr", {{"class", "more"}},
                   element("td", {{"colspan", width()}}, element("dl", {}, list)));
  }

  const FigureTable& figures_;
  std::vector<std::size_t> shown_, folded_;  ///< places of columns
};

}  // namespace

Html toHtml(const FigureTable& figures) {
  // A region that scrolls must be reachable with the keyboard.
  const Attributes region{{"class", "scroll"},
                          {"tabindex", "0"},
                          {"role", "region"},
                          {"aria-label", figures.table.title}};
  return element("div", region, TableWriter(figures).table());
}

}  // namespace esvr::report
