#pragma once
/// The points of curves as data files and as pictures.

#include <filesystem>
#include <string>
#include <vector>

#include "compare/curves_page.h"

namespace esvr::compare {

/// The output files, whose names begin with a prefix.
[[nodiscard]] std::vector<std::filesystem::path> curveFiles(const std::string& prefix);

/// Writes all files. \throws RuntimeFailure  a file is not writable
void writeCurves(const std::string& prefix, const CurvesReport& report, bool overwrite);

}  // namespace esvr::compare
