#pragma once
/// Options of what is compared, and where, which `table` and `curves` share.

#include "cli/command_line.h"
#include "compare/table_options.h"

namespace esvr::compare {

/// The reference and candidates too.
void addSceneOptions(cli::CommandLine& line);
/// \throws UsageError  a value out of range
void readSceneOptions(const cli::Arguments& arguments, TableOptions& options);

}  // namespace esvr::compare
