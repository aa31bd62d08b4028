#pragma once
/// What `esvr-compare curves` is asked to do.

#include <optional>
#include <string>

#include "compare/table_options.h"

namespace esvr::compare {

struct CurvesOptions {
  TableOptions table;  ///< the files, sizes and baselines
  std::string prefix;  ///< of the files that are written
  bool overwrite = false;
};

/// \param argv  the job's word first
/// \return nothing where --help or --version was printed
/// \throws UsageError
[[nodiscard]] std::optional<CurvesOptions> parseCurvesOptions(int argc, const char* const* argv);

}  // namespace esvr::compare
