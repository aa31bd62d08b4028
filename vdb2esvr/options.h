#pragma once
/// What vdb2esvr is asked to do.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/log.h"
#include "esvr/convert.h"
#include "esvr/vdb_io.h"

namespace esvr::vdb2esvr {

inline constexpr const char* kProgram = "vdb2esvr";

/// What becomes of an interrupted run's best so far.
enum class OnCancel { kKeep, kDiscard };

struct Options {
  std::filesystem::path input, output;
  std::vector<std::string> grids;     ///< empty: all that can be fitted
  ConvertOptions convert;             ///< the goal of every grid, where no size was asked for
  std::optional<double> psnr;         ///< dB over the box that every grid was asked to reach
  std::optional<std::uint64_t> size;  ///< bytes of the file
  std::optional<double> ratio;        ///< bytes of the input for each byte of the file
  std::optional<PaperMethod> paper;   ///< in the place of our method
  ReadOptions read;
  std::string device = "auto";
  OnCancel onCancel = OnCancel::kKeep;
  std::string report;      ///< empty: none; cli::kStandardOutput
  bool countHits = false;  ///< for the report
  bool overwrite = false;
  int threads = 0;  ///< 0: all
  cli::Verbosity verbosity = cli::Verbosity::kNormal;
  std::vector<std::string> commandLine;
};

/// \return nothing where --help or --version was printed
/// \throws UsageError
[[nodiscard]] std::optional<Options> parseOptions(int argc, const char* const* argv);

}  // namespace esvr::vdb2esvr
