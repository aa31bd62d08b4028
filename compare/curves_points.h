#pragma once
/// The points of curves.

#include <map>
#include <string>
#include <vector>

#include "compare/table_record.h"
#include "report/data_table.h"

namespace esvr::compare {

/// Kinds of points: those of the curve of a fit, and files.
inline constexpr const char *kFitPoint = "fit", *kFilePoint = "file";

/// The rows with bytes and figures of each curve, by bytes. Rows of the same name form a curve, and
/// all rows of ESVR form one.
[[nodiscard]] std::map<std::string, std::vector<const TableRow*>> rowsBySeries(
    const TableRecord& record);

/// All points. Files are in the order of rowsBySeries.
[[nodiscard]] report::DataTable curvePoints(const TableRecord& record);

}  // namespace esvr::compare
