#pragma once
/// Points of curves as data and as pictures.

#include <filesystem>
#include <string>
#include <vector>

#include "compare/table_record.h"

namespace esvr::compare {

/// Files that begin with a prefix.
[[nodiscard]] std::vector<std::filesystem::path> curveFiles(const std::string& prefix, bool fps);

struct CurvesReport {
  const TableRecord& record;
  const std::vector<std::string>& commandLine;
};

/// Writes them all. \throws RuntimeFailure  not writable
void writeCurves(const std::string& prefix, const CurvesReport& report, bool overwrite);

}  // namespace esvr::compare
