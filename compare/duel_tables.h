#pragma once
/// Tables of ESVR beside its best rivals.

#include <vector>

#include "compare/finding.h"
#include "report/html.h"

namespace esvr::compare {

/// A section with all figures of one duel, or with the PSNR of several; nothing if no row has a
/// rival.
[[nodiscard]] report::Html duelSection(const std::vector<Duel>& duels, const TableRecord& record);

}  // namespace esvr::compare
