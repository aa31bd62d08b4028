#pragma once
/// The options of `esvr-compare check`.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/error_bound.h"
#include "cli/frame_range.h"
#include "cli/host_memory.h"
#include "cli/log.h"
#include "compare/differences.h"
#include "compare/figures.h"
#include "esvr/coord.h"

namespace esvr::compare {

struct CheckOptions {
  std::filesystem::path reference, candidate;
  cli::InputFiles inputs;
  std::optional<std::vector<cli::FrameNumber>>
      frames;                      ///< frames that are compared, of sequences; nothing: all
  std::vector<std::string> grids;  ///< NAME or NAME=NAME IN CAND; empty: all
  /// Grids that are not compared, and that only one of the files may have.
  std::set<std::string> ignored;
  std::array<std::optional<cli::ErrorBound>, kFigureCount> limits;
  std::optional<std::uint64_t> maxBytes;
  std::set<DifferenceKind> failOn;
  std::optional<std::filesystem::path> baseline;
  bool update = false;  ///< whether the baseline is written
  std::optional<Box> box;
  std::optional<double> peak;
  bool ssim = false;   ///< whether SSIM is measured without a limit on it
  std::string report;  ///< file name or "-"; empty: no report
  bool overwrite = false;
  cli::HostMemory memory;  ///< memory that input may take
  int threads = 0;
  cli::Verbosity verbosity = cli::Verbosity::kNormal;
  std::vector<std::string> commandLine;
};

/// \param argv  arguments, beginning with the command ("check")
/// \return nothing if --help or --version was printed
/// \throws UsageError  an option is invalid
[[nodiscard]] std::optional<CheckOptions> parseCheckOptions(int argc, const char* const* argv);

}  // namespace esvr::compare
