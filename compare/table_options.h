#pragma once
/// The options of `esvr-compare table`.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/host_memory.h"
#include "cli/log.h"
#include "compare/external.h"
#include "compare/external_command.h"
#include "compare/gallery.h"
#include "compare/report_options.h"
#include "esvr/baseline.h"
#include "esvr/coord.h"

namespace esvr::compare {

struct TableOptions {
  cli::InputFiles inputs;  ///< reference, candidates and transfer functions
  std::filesystem::path reference;
  std::vector<std::filesystem::path> candidates;
  std::optional<std::string> grid;  ///< default: the first grid with voxels
  bool lossless = true, quantised = true, matched = true, zfp = true;
  std::vector<BaselineSetting> settings;  ///< baselines of --row, which replace the others
  std::vector<std::uint64_t> sizes;       ///< sizes to match besides the candidates'
  std::vector<double> psnrs;              ///< PSNRs over the box to match, dB
  std::vector<double> activePsnrs;        ///< PSNRs over the active voxels to match, dB
  std::vector<std::uint64_t> fits;        ///< sizes for which ellipsoids are fitted
  bool fitDefault = false;                ///< whether a fit with the default options is made
  bool fitPaper = false;                  ///< whether a fit by the paper's method is made
  std::vector<External> externals;
  std::vector<ExternalCommand> commands;  ///< compressors that a command runs
  int runs = 3;
  std::uint64_t maxDense = 0;
  std::optional<Box> box;
  std::optional<double> peak;
  std::string device;
  GalleryOptions images;
  ReportFiles files;
  cli::HostMemory memory;  ///< memory that input may take
  int threads = 0;
  cli::Verbosity verbosity = cli::Verbosity::kNormal;
  std::vector<std::string> commandLine;
};

/// All files that a run reads.
[[nodiscard]] std::vector<std::filesystem::path> inputsOf(const TableOptions& options);

/// \param argv  arguments, beginning with the command ("table")
/// \return nothing if --help or --version was printed
/// \throws UsageError  an option is invalid
[[nodiscard]] std::optional<TableOptions> parseTableOptions(int argc, const char* const* argv);

}  // namespace esvr::compare
