#pragma once
/// The options of esvr-view.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/host_memory.h"
#include "cli/log.h"
#include "esvr/renderer.h"

namespace esvr::view {

inline constexpr const char* kProgram = "esvr-view";

struct Options {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path exported;  ///< page to write instead of serving; empty: none
  bool overwrite = false;
  std::string bind = "127.0.0.1";  ///< address to listen at
  int port = 0;                    ///< 0: one that is free
  bool open = false;               ///< open the page in a browser
  int clients = 0;                 ///< clients at a time
  std::string device = "auto";
  RendererLimits limits;
  cli::HostMemory memory;  ///< memory that input may take
  int threads = 0;         ///< 0: all
  cli::Verbosity verbosity = cli::Verbosity::kNormal;
};

/// Parses the command line. \return nothing if --help or --version was printed
/// \throws UsageError  the options are wrong
[[nodiscard]] std::optional<Options> parseOptions(int argc, const char* const* argv);

}  // namespace esvr::view
