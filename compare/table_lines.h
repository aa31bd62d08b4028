#pragma once
/// Sentences about a table, for all its forms.

#include <string>

#include "compare/table_record.h"

namespace esvr::compare {

/// The grid, its voxels, the box and the peak.
[[nodiscard]] std::string sceneLine(const TableRecord& record);
/// The device that drew the pictures and the cost of the reference's; empty without pictures.
[[nodiscard]] std::string pictureLine(const TableRecord& record);
/// Which rows are rivals (finding.h).
[[nodiscard]] std::string rivalRule();
/// Whether rows are missing; empty if not.
[[nodiscard]] std::string interruption(const TableRecord& record);

}  // namespace esvr::compare
