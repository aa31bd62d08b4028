#pragma once
/// Writes an output file from bytes in memory.

#include <cstddef>
#include <filesystem>
#include <span>

namespace esvr::cli {

/// Writes the whole file or nothing. A device or a pipe, such as /dev/null, is written directly.
/// \throws RuntimeFailure  the file exists (without `overwrite`) or is not writable; the disk is
///                         full
void writeBytes(const std::filesystem::path& path, std::span<const std::byte> bytes,
                bool overwrite);

}  // namespace esvr::cli
