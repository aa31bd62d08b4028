#pragma once
/// What `esvr-compare table` is asked to do.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/log.h"
#include "compare/external.h"
#include "compare/gallery.h"
#include "compare/report_options.h"
#include "esvr/baseline.h"
#include "esvr/coord.h"

namespace esvr::compare {

struct TableOptions {
  std::filesystem::path reference;
  std::vector<std::filesystem::path> candidates;
  std::optional<std::string> grid;  ///< default: the first with voxels
  bool lossless = true, quantised = true, matched = true, zfp = true;
  std::vector<BaselineSetting> settings;  ///< these baselines and no others
  std::vector<std::uint64_t> sizes;       ///< to match beside the candidates'
  std::vector<std::uint64_t> fits;        ///< sizes to fit ellipsoids to, here
  bool fitDefault = false;                ///< fit with the defaults, whatever size that takes
  bool fitPaper = false;                  ///< fit by the paper's method
  std::vector<External> externals;
  int runs = 3;
  std::uint64_t maxDense = 0;
  std::optional<Box> box;
  std::optional<double> peak;
  std::string device;
  GalleryOptions images;
  ReportFiles files;
  std::uint64_t maxMemory = 0;  ///< bytes that input may take
  int threads = 0;
  cli::Verbosity verbosity = cli::Verbosity::kNormal;
  std::vector<std::string> commandLine;
};

/// \param argv  the job's word first
/// \return nothing where --help or --version was printed
/// \throws UsageError
[[nodiscard]] std::optional<TableOptions> parseTableOptions(int argc, const char* const* argv);

}  // namespace esvr::compare
