#pragma once
/// The pages: the viewer that the server gives to browsers, and pages that need no server, because
/// they contain the file and draw it themselves.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "programs/memory.h"

namespace esvr::view {

/// The viewer as one HTML file.
[[nodiscard]] std::string_view viewPage();

/// The viewer that draws by itself, without a file in it.
[[nodiscard]] std::string_view exportPageBundle();

/// The largest file in a page, in bytes. Base64 makes it a third larger, and browsers have limits
/// on the length of a text.
inline constexpr std::uintmax_t kMostExportedBytes = std::uintmax_t{256} << 20;

/// The page for exported files with a file in it.
/// \param page   as exportPageBundle()
/// \param name   of the file, which the page shows
/// \param bytes  of the file
/// \throws std::logic_error  the page has no place for a file
[[nodiscard]] std::string exportedPage(std::string_view page, const std::string& name,
                                       std::string_view bytes);

/// What is to be exported.
struct Export {
  std::filesystem::path input, output;
  bool overwrite = false;
  cli::HostMemory memory;  ///< memory that reading the input may take
};

/// Writes the page of a file.
/// \throws UsageError      the input is no .esvr file of one frame, or is too large for a page; the
///                         output is no .html file
/// \throws BadInput, MemoryExceeded  as for showFile
/// \throws RuntimeFailure  as for cli::writeBytes
void exportPage(const Export& what);

}  // namespace esvr::view
