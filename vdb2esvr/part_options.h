#pragma once
/// The options --resume, --part and --merge.

#include "cli/command_line.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

void addPartOptions(cli::po::options_description& options);

/// Reads the options. They may change what an interrupted run keeps (Options::keepsBest).
/// \throws UsageError  an option is invalid or contradicts another one
void readParts(const cli::Arguments& a, Options& options);

}  // namespace esvr::vdb2esvr
