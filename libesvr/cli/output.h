#pragma once
/// A program's output file.

#include <filesystem>
#include <initializer_list>
#include <string_view>
#include <vector>

namespace esvr::cli {

/// Fails before the work where writing would fail after it.
/// \throws UsageError  another extension; RuntimeFailure: exists (without `overwrite`), not
/// writable
void checkOutput(const std::filesystem::path& path,
                 std::initializer_list<std::string_view> extensions, bool overwrite);

/// \throws UsageError  two of them are one file, whatever links lie between
void requireDistinct(const std::vector<std::filesystem::path>& files);

}  // namespace esvr::cli
