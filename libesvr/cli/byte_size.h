#pragma once
/// Sizes of files as people write them.

#include <cstdint>
#include <string>

namespace esvr::cli {

/// "50000", "50KB", "2.6MB" (1000s), "48KiB" (1024s), in any case; at least 1.
/// \throws UsageError  anything else; names the option
[[nodiscard]] std::uint64_t parseByteSize(const std::string& option, const std::string& text);

}  // namespace esvr::cli
