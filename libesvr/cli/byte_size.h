#pragma once
/// Sizes of files and memory in options.

#include <cstdint>
#include <string>

namespace esvr::cli {

/// Parses "50000", "50KB" or "2.6MB" (units of 1000), or "48KiB" (units of 1024), in upper or lower
/// case. The size is at least 1.
/// \throws UsageError  the text is not of this form; the message names the option
[[nodiscard]] std::uint64_t parseByteSize(const std::string& option, const std::string& text);

/// Parses the memory of a GPU in the same form. A number without a unit below 1,000,000 is one of
/// gigabytes, as in the first versions of --max-vram; as bytes it would be less than a GPU can use.
/// \return at least 1,000,000
/// \throws UsageError  the text is not of this form, or the memory is less
[[nodiscard]] std::uint64_t parseDeviceMemory(const std::string& option, const std::string& text);

}  // namespace esvr::cli
