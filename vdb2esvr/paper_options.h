#pragma once
/// The option --paper: the paper's method in the place of ours, and its settings as KEY=VALUE.

#include <string>
#include <vector>

#include "esvr/paper_method.h"

namespace esvr::vdb2esvr {

/// The text of `--help paper`: every key with its default.
[[nodiscard]] std::string paperHelp();

/// \param given  values of --paper, each a list KEY=VALUE[,KEY=VALUE...], or "default"
/// \throws UsageError  a key that is not there, twice or with a value that makes no sense
[[nodiscard]] PaperMethod readPaperMethod(const std::vector<std::string>& given);

}  // namespace esvr::vdb2esvr
