#pragma once
/// The versions in a JSON report.

#include <nlohmann/json_fwd.hpp>

namespace esvr::cli {

/// An object with the versions of ESVR, the file format, the VDB libraries and CUDA.
[[nodiscard]] nlohmann::ordered_json versionJson();

}  // namespace esvr::cli
