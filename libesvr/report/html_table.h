#pragma once
/// A table of figures within a page.

#include <string>
#include <vector>

#include "report/data_table.h"
#include "report/emphasis.h"
#include "report/html.h"

namespace esvr::report {

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

/// Columns without a figure are left out. Every cell of a column of numbers has its number with all digits in the attribute data-value,
/// which is empty where there is none.
[[nodiscard]] Html toHtml(const FigureTable& figures);

}  // namespace esvr::report
