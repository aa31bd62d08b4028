#pragma once
/// The option --paper, which replaces our method by the paper's, with settings KEY=VALUE, and its
/// part of the report.

#include <cstdint>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "esvr/paper_method.h"

namespace esvr::vdb2esvr {

/// The largest number of ellipsoids that options may name.
inline constexpr std::int64_t kMaxEllipsoids = std::numeric_limits<std::uint32_t>::max();

/// The text of `--help paper`: every key with its default.
[[nodiscard]] std::string paperHelp();

/// \param given  values of --paper: each is a list KEY=VALUE[,KEY=VALUE...] or "default"
/// \throws UsageError  a key is unknown, given twice or has an invalid value
[[nodiscard]] PaperMethod readPaperMethod(const std::vector<std::string>& given);

[[nodiscard]] nlohmann::ordered_json paperJson(const PaperRecord& record);

}  // namespace esvr::vdb2esvr
