#pragma once
/// The output files of a program.

#include <filesystem>
#include <initializer_list>
#include <string_view>
#include <vector>

namespace esvr::cli {

/// \throws UsageError  the extension is none of these
void requireExtension(const std::filesystem::path& path,
                      std::initializer_list<std::string_view> extensions);

/// Checks before the work begins that a file can be written. Reports and pictures may go to a
/// device or a pipe of any name.
/// \throws UsageError  the extension is another one
/// \throws RuntimeFailure  the file exists (without `overwrite`) or is not writable
void checkOutput(const std::filesystem::path& path,
                 std::initializer_list<std::string_view> extensions, bool overwrite);

/// \throws UsageError  two of the paths are the same file, also through links
void requireDistinct(const std::vector<std::filesystem::path>& files);

}  // namespace esvr::cli
