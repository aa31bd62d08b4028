#pragma once
/// The plots of curves.

#include <string>
#include <vector>

#include "compare/table_record.h"
#include "report/plot.h"

namespace esvr::compare {

/// A plot and the suffix of its file's name.
struct NamedPlot {
  std::string ending;
  report::Plot plot;
};

/// Error over run time, error over bytes and speed over bytes, as far as they were measured.
[[nodiscard]] std::vector<NamedPlot> curvePlots(const TableRecord& record);

}  // namespace esvr::compare
