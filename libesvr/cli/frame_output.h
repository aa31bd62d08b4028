#pragma once
/// The outputs of frames.

#include <filesystem>

namespace esvr::cli {

/// Copies the output of a frame to that of another one. The copy appears under its name when it is
/// complete.
/// \throws RuntimeFailure  the copy exists (without `overwrite`) or is not writable; the disk is
///                         full
void copyOutput(const std::filesystem::path& from, const std::filesystem::path& to, bool overwrite);

}  // namespace esvr::cli
