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

/// Checks that no output of a run is one of its inputs or another one of its outputs, be it by the
/// same name, through a link or as the same inode. Empty names and "-" (standard input and output)
/// are no files, and devices such as /dev/null may be named several times.
/// \throws UsageError  the text names both
void requireSeparate(const std::vector<std::filesystem::path>& inputs,
                     const std::vector<std::filesystem::path>& outputs);

}  // namespace esvr::cli
