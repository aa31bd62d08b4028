#pragma once
/// The options that `table` and `curves` share.

#include "cli/command_line.h"
#include "compare/table_options.h"

namespace esvr::compare {

/// Adds the options and the arguments for the reference and the candidates.
void addSceneOptions(cli::CommandLine& line);
/// \throws UsageError  a value is out of range
void readSceneOptions(const cli::Arguments& arguments, TableOptions& options);

}  // namespace esvr::compare
