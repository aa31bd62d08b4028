#pragma once
/// What vdb2esvr is asked to do.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/log.h"
#include "esvr/compact.h"
#include "esvr/fit.h"
#include "esvr/vdb_io.h"

namespace esvr::vdb2esvr {

inline constexpr const char* kProgram = "vdb2esvr";

/// What becomes of an interrupted run's best so far.
enum class OnCancel { kKeep, kDiscard };

/// How the file holds the ellipsoids' attributes.
enum class Storage { kCompact, kFloat32 };

/// Voxels that must come back exactly or within a bound.
struct VoxelDemand {
  bool exact = false;
  double bound = 0.0;     ///< in the grid's values, or a share of their range
  bool relative = false;  ///< `bound` is a share
  bool alone = false;     ///< without trying ellipsoids and a residual
};

struct Options {
  std::filesystem::path input, output;
  std::vector<std::string> grids;  ///< empty: all that can be fitted
  FitOptions fit;
  std::optional<std::uint64_t> size;  ///< bytes of the file
  std::optional<double> ratio;        ///< bytes of the input for each of the file
  std::optional<VoxelDemand> voxels;  ///< instead of ellipsoids
  Activity activity = Activity::kByValue;
  Storage storage = Storage::kCompact;
  double storageLoss = CompactOptions::kDefaultLoss;  ///< dB that kCompact may cost
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

/// Whether --psnr looks for the smallest file: not where a number or a time bounds it.
[[nodiscard]] bool searchesForPsnr(const Options& options);

/// \return nothing where --help or --version was printed
/// \throws UsageError
[[nodiscard]] std::optional<Options> parseOptions(int argc, const char* const* argv);

}  // namespace esvr::vdb2esvr
