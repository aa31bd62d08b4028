#pragma once
/// The charts of curves.

#include <vector>

#include "compare/table_record.h"
#include "report/chart.h"

namespace esvr::compare {

/// Error over run time, error over bytes and speed over bytes, as far as they were measured.
[[nodiscard]] std::vector<report::Chart> curveCharts(const TableRecord& record);

}  // namespace esvr::compare
