#pragma once
/// The options of `esvr-compare stability`.

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/frame_range.h"
#include "cli/host_memory.h"
#include "cli/log.h"

namespace esvr::compare {

struct StabilityRequest {
  std::filesystem::path file;
  std::optional<std::vector<cli::FrameNumber>> frames;  ///< of a sequence; nothing: all
  std::vector<std::string> grids;                       ///< empty: all
  std::size_t samples = 0;                              ///< bricks of each grid
  double maxDifference = 0.0;                           ///< relative to the peak of a grid
  std::string device;                                   ///< "auto": the CPU, and a GPU if usable
  std::string report;                                   ///< JSON file, "-" or empty
  bool overwrite = false;
  cli::HostMemory memory;
  int threads = 0;
  cli::Verbosity verbosity = cli::Verbosity::kNormal;
  std::vector<std::string> commandLine;
};

/// \return nothing if --help or --version was printed
/// \throws UsageError
[[nodiscard]] std::optional<StabilityRequest> parseStabilityOptions(int argc,
                                                                    const char* const* argv);

}  // namespace esvr::compare
