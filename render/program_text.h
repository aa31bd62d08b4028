#pragma once
/// The text of `esvr-render --help` around the list of options.

#include "cli/command_line.h"

namespace esvr::render {

[[nodiscard]] cli::ProgramText programText();

}  // namespace esvr::render
