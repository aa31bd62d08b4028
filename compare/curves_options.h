#pragma once
/// The options of `esvr-compare curves`.

#include <optional>
#include <string>

#include "compare/table_options.h"

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

}  // namespace esvr::compare
