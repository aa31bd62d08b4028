#pragma once
/// esvr-compare check: compares a file with its reference and fails if it differs too much.

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "compare/figures.h"
#include "compare/grid_file.h"
#include "esvr/device.h"
#include "esvr/metrics.h"
#include "esvr/volume.h"
#include "programs/option_values.h"
#include "programs/resources.h"
#include "programs/run_main.h"
#include "programs/sequence.h"

namespace esvr::compare {

/// What two grids differ in besides their voxels.
enum class DifferenceKind {
  kName,
  kClass,
  kValueType,
  kBackground,
  kTransform,
  kMetadata,
  kInactive  ///< values of inactive voxels and tiles
};

struct Difference {
  DifferenceKind kind = DifferenceKind::kName;
  std::string text;  ///< text with the reference first: "class: level set, fog volume"
};

struct CheckOptions {
  std::filesystem::path reference, candidate;
  cli::InputFiles inputs;
  std::optional<std::vector<cli::FrameNumber>>
      frames;                      ///< frames that are compared, of sequences; nothing: all
  std::vector<std::string> grids;  ///< NAME or NAME=NAME IN CAND; empty: all
  /// Grids that are not compared, and that only one of the files may have.
  std::set<std::string> ignored;
  std::array<std::optional<cli::ErrorBound>, kFigureCount> limits;
  std::optional<double> relativeFloor;  ///< the floor of the limit on the relative error
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

struct CheckedGrid {
  std::string name, candidateName;  ///< unique names in the two files
  VolumeMetrics metrics{};
  FigureValues figures{};
  std::vector<Difference> differences{};
  std::optional<std::int64_t> frame{};  ///< number of its frame, if the files are sequences
  double range = 0.0;  ///< to which limits in % refer: valueRangeOf() or valueRangeOfVectors()
  /// The rows of vectors, for which limits of their own hold (LimitedRows, figures.h); nothing: numbers.
  std::optional<LimitedRows> vectors{};
};

struct CheckRecord {
  std::uint64_t candidateBytes = 0;
  std::vector<CheckedGrid> grids;
  std::vector<Difference> fileDifferences;
  /// Grids without figures that are the same in both files, one line each.
  std::vector<std::string> same;
  std::vector<std::string> skipped;   ///< grids that cannot be compared, with the reason
  std::vector<std::string> extra;     ///< grids of the candidate that the reference does not have
  std::vector<std::string> failures;  ///< one line for each failure
  /// Grids whose voxels cannot be compared, such as those with NaN, with the reason.
  std::vector<std::string> unreadable;
  std::vector<std::string> notes;  ///< remarks that are not failures
};

/// \param argv  arguments, beginning with the command ("check")
/// \return nothing if --help or --version was printed
/// \throws UsageError  an option is invalid
[[nodiscard]] std::optional<CheckOptions> parseCheckOptions(int argc, const char* const* argv);

/// Compares the files and prints figures and differences.
/// \throws TargetMissed  a limit is missed; the text lists every failure
/// \throws BadInput  the files cannot be compared
void check(const CheckOptions& options);

// The comparison of two files (compare_files.cpp).

/// The volumes of a grid in the two files, and its peak in the reference.
struct ComparedVolumes {
  const SparseVolume& reference;
  const SparseVolume& candidate;
  double peak = 0.0;
};

/// Compares the change of grids from one frame of a sequence to the next. It keeps the volumes of
/// two frames at most.
class TemporalComparison {
 public:
  explicit TemporalComparison(const CheckOptions& options) : options_(options) {}

  /// Begins the next frame.
  void beginFrame();

  /// The PSNR of the temporal difference of a grid, dB, with the larger one of the peaks of the two
  /// frames; nothing if the frame before did not have the grid with an active voxel.
  [[nodiscard]] std::optional<double> compare(const std::string& grid,
                                              const ComparedVolumes& volumes);

 private:
  struct Volumes {
    SparseVolume reference, candidate;
    double peak = 0.0;
  };
  const CheckOptions& options_;
  std::map<std::string, Volumes> before_, current_;  ///< by the name of the grid
};

struct FilePair {
  const GridFile& reference;
  const GridFile& candidate;
  const CancelToken& cancel;
};

/// Compares the grids that the options name, and judges limits and differences.
/// \param temporal  compares with the frame before, if the files are frames of sequences; else null
/// \throws BadInput  the files cannot be compared
/// \throws Cancelled
[[nodiscard]] CheckRecord compareFiles(const CheckOptions& options, const FilePair& files,
                                       TemporalComparison* temporal);

// What has been measured is judged by the limits of the options, and by a baseline (figures.cpp). A baseline has figures of
// an earlier run in a JSON file, for example
//
//     {"schema": "esvr-baseline", "schema_version": 1,
//      "bytes": {"value": 21704, "tolerance": 217},
//      "grids": {"density": {"psnr_box": {"value": 58.3, "tolerance": 0.05}, ...}}}
//
// A PSNR of null means that there was no error. Figures may be left out.

/// Appends a line to the record's failures for every limit that a grid misses.
void judgeLimits(const CheckOptions& options, CheckRecord& record);

/// Appends a line if the file is larger than allowed.
void judgeBytes(const CheckOptions& options, CheckRecord& record);

/// Appends a line for every difference of the kinds that fail.
void judgeDifferences(const CheckOptions& options, CheckRecord& record);

/// Appends failures for figures that are worse by more than their tolerance, and notes for figures
/// that are better and for grids that the baseline does not have.
/// \throws BadInput  the file is missing or is not a baseline
void judgeBaseline(const std::filesystem::path& path, CheckRecord& record);

/// True if the file exists and has an SSIM, which must then be measured.
[[nodiscard]] bool baselineHasSsim(const std::filesystem::path& path);

/// Writes the record's figures. Tolerances of an existing file are kept.
/// \throws BadInput  the existing file is not a baseline
/// \throws RuntimeFailure  the file is not writable
void updateBaseline(const std::filesystem::path& path, const CheckRecord& record);

}  // namespace esvr::compare
