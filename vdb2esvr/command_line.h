#pragma once
/// What `vdb2esvr --help` says, and the options that it has.

#include "cli/command_line.h"

namespace esvr::vdb2esvr {

[[nodiscard]] cli::CommandLine commandLine();

}  // namespace esvr::vdb2esvr
