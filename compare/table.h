#pragma once
/// esvr-compare table, the paper's tables for any volume.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compare/external.h"
#include "compare/gallery.h"
#include "compare/options.h"
#include "compare/table_record.h"
#include "esvr/baseline.h"
#include "esvr/device.h"
#include "esvr/volume.h"
#include "programs/resources.h"
#include "programs/run_main.h"

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

/// Reads the reference and makes all rows (rows.cpp). If the run is interrupted, finished rows are kept.
/// \throws BadInput  the reference has no active voxel, or cannot be compared; as for readGrid
[[nodiscard]] TableRecord makeRows(const TableOptions& options, const CancelToken& cancel,
                                   const cli::Log& log);

/// Makes the rows, prints them and writes the reports.
/// \throws BadInput  the files cannot be compared
/// \throws RuntimeFailure  the run was interrupted; finished rows were printed and written
void table(const TableOptions& options);

}  // namespace esvr::compare
