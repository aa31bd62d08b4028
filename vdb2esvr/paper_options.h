#pragma once
/// Options of --preset paper.

#include <optional>

#include "cli/command_line.h"
#include "esvr/paper_method.h"

namespace esvr::vdb2esvr {

/// A group of its own in --help.
[[nodiscard]] cli::po::options_description paperOptions();

/// \return nothing without --preset paper
/// \throws UsageError  an option of the paper's method without it, or one that makes no sense
[[nodiscard]] std::optional<PaperMethod> paperMethod(const cli::Arguments& arguments);

}  // namespace esvr::vdb2esvr
