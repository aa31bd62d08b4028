#pragma once
/// An output file whose bytes are all there.

#include <cstddef>
#include <filesystem>
#include <span>

namespace esvr::cli {

/// Writes it whole or not at all. \throws RuntimeFailure  exists (without `overwrite`), not
/// writable, disk full
void writeBytes(const std::filesystem::path& path, std::span<const std::byte> bytes,
                bool overwrite);

}  // namespace esvr::cli
