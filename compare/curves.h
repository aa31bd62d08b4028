#pragma once
/// esvr-compare curves: error over run time, error over bytes, pictures per second over bytes.

#include <optional>
#include <string>

#include "compare/table.h"

namespace esvr::compare {

struct CurvesOptions {
  TableOptions table;  ///< the files, sizes and baselines
  std::string prefix;  ///< prefix of the names of the written files
  bool overwrite = false;
};

/// \param argv  arguments, beginning with the command ("curves")
/// \return nothing if --help or --version was printed
/// \throws UsageError  an option is invalid
[[nodiscard]] std::optional<CurvesOptions> parseCurvesOptions(int argc, const char* const* argv);

/// Measures the points and writes all files.
/// \throws BadInput  the files cannot be compared
/// \throws RuntimeFailure  the run was interrupted; finished points were written
void curves(const CurvesOptions& options);

}  // namespace esvr::compare
