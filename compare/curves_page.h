#pragma once
/// Curves as a page.

#include <filesystem>
#include <string>
#include <vector>

#include "compare/table_record.h"

namespace esvr::compare {

struct CurvesReport {
  const std::filesystem::path& reference;
  const TableRecord& record;
  const std::vector<std::string>& commandLine;
};

/// The page as HTML: the plots, and all points.
[[nodiscard]] std::string curvesPage(const CurvesReport& report);

}  // namespace esvr::compare
