#pragma once
/// The options of vdb2esvr, the goals that single grids have instead of the goal of all others, and the settings of the
/// paper's method.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/convert_file.h"
#include "esvr/encode.h"
#include "esvr/grid.h"
#include "esvr/paper_method.h"
#include "esvr/vdb_io.h"
#include "programs/command_line.h"
#include "programs/option_values.h"
#include "programs/run_main.h"
#include "programs/sequence.h"
#include "programs/splat_input.h"
#include "vdb2esvr/progress_bar.h"

namespace esvr::vdb2esvr {

/// Names of grids in the options --grid, --keep and --skip.
struct WantedGrids {
  std::vector<std::string> only;  ///< empty: all grids
  std::vector<std::string> keep;  ///< carried unchanged, even if they could be fitted
  std::vector<std::string> skip;  ///< left out
  bool lossless = false;          ///< whether doubles, which are fitted as float32, are carried
};

/// A grid that is not fitted, and the reason.
struct NotFitted {
  GridSummary grid;
  std::size_t place = 0;  ///< index of the grid in VdbSummary::grids
  std::string why;
};

/// A grid that is fitted: one of numbers, or a component of a grid of vectors.
struct FittedGrid {
  GridSummary source;                      ///< the grid of the input
  std::size_t place = 0;                   ///< its index in VdbSummary::grids
  std::optional<std::size_t> component{};  ///< of vectors
  std::string uniqueName;  ///< of the grid or the component, by GridNames of the input

  /// The name in its descriptor.
  [[nodiscard]] std::string storedName() const {
    return component ? componentName(source.name, *component) : source.name;
  }
};

struct GridChoice {
  std::vector<FittedGrid> fitted;  ///< grids in file order; the components of vectors in theirs
  std::vector<NotFitted> carried, skipped;
};

inline constexpr const char* kProgram = "vdb2esvr";
/// The largest number of ellipsoids that options may name.
inline constexpr std::int64_t kMaxEllipsoids = std::numeric_limits<std::uint32_t>::max();

// The words of options, by which the report names the same things.
inline constexpr std::initializer_list<cli::Choice<Preset>> kPresets{
    {"draft", Preset::kDraft}, {"standard", Preset::kStandard}, {"high", Preset::kHigh}};
inline constexpr std::initializer_list<cli::Choice<Storage>> kStorages{
    {"compact", Storage::kCompact}, {"float32", Storage::kFloat32}};
inline constexpr std::initializer_list<cli::Choice<Activity>> kActivities{
    {"auto", Activity::kByValue}, {"exact", Activity::kExact}};
inline constexpr std::initializer_list<cli::Choice<Representation>> kRepresentations{
    {"auto", Representation::kAuto},
    {"ellipsoids", Representation::kEllipsoids},
    {"voxels", Representation::kVoxels}};
inline constexpr std::initializer_list<cli::Choice<Measure>> kMeasures{
    {"auto", Measure::kAuto}, {"values", Measure::kValues}};
inline constexpr std::initializer_list<cli::Choice<bool>> kShares{{"auto", true}, {"off", false}};

/// The goal of a single grid.
struct GridGoal {
  std::string grid;  ///< name in the input; a grid of vectors stands for its components
  Goal goal;
  std::size_t place = 0;  ///< of the grid in the input (resolveNames)
};

struct Options {
  std::filesystem::path input, output;
  cli::InputFiles inputs;
  /// The frames, if the input is a pattern. The output is a pattern, too, or one file for all
  /// frames.
  std::optional<cli::Sequence> sequence;
  FrameBefore previous;  ///< of a frame of a group that is not the first one
  WantedGrids grids;
  bool shares = true;               ///< grids of a file share what they have in common
  ConvertOptions convert;           ///< options and goal of every grid; a size replaces the goal
  std::vector<GridGoal> gridGoals;  ///< goals of single grids instead of that in `convert`
  /// PSNR that all other grids should reach, dB over the box. It is the goal in `convert`, too, but for a
  /// single fit, which ends when it is reached (convert.fit.psnr).
  std::optional<double> psnr;
  std::optional<double> picturePsnr;  ///< PSNR of what is seen of grids that are looked through, dB
  std::optional<BoundGoal> maxError;  ///< largest error of all other grids
  std::optional<std::uint64_t> size;  ///< largest size of the file, bytes
  std::optional<double> ratio;        ///< size of the input relative to that of the file
  std::optional<PaperMethod> paper;   ///< the paper's method, if it replaces ours
  ReadOptions read;
  std::optional<cli::SplatsAsVdb::Source> splats;  ///< the input, if it has splats
  std::string device = "auto";
  bool resume = false;    ///< parts are kept in a folder until the file is written
  bool onlyFits = false;  ///< the process is a rank of MPI above 0, which writes no file
  std::string report;     ///< file name, or cli::kStandardOutput; empty: no report
  bool overwrite = false;
  ProgressForm progress = ProgressForm::kText;
  int threads = 0;  ///< number of threads; 0: all
  cli::Verbosity verbosity = cli::Verbosity::kNormal;
  std::vector<std::string> commandLine;

  /// The input as the user named it; splats are read from a file that was made of them.
  [[nodiscard]] const std::filesystem::path& namedInput() const {
    return splats ? splats->path : input;
  }

  /// True if an interrupted run writes its best state. A run that is continued later keeps its
  /// finished parts, and a frame that ended early would look as if it were complete.
  [[nodiscard]] bool keepsBest() const { return !resume && !sequence; }
};

/// \return nothing if --help or --version was printed
/// \throws UsageError  an option is invalid
[[nodiscard]] std::optional<Options> parseOptions(int argc, const char* const* argv);

/// What `vdb2esvr --help` says, and the options that it has (command_line.cpp).
[[nodiscard]] cli::CommandLine commandLine();

/// The text of `--help paper`: every setting of --paper with its default.
[[nodiscard]] std::string paperHelp();

/// \param given  values of --paper: each is a list KEY=VALUE[,KEY=VALUE...] or "default"
/// \throws UsageError  a key is unknown, given twice or has an invalid value
[[nodiscard]] PaperMethod readPaperMethod(const std::vector<std::string>& given);

/// Finds the places of the grids that options name.
/// \throws BadInput  there is no grid of a name, or it is ambiguous; the text lists the grids
/// \throws UsageError  two goals are those of one grid
void resolveNames(const VdbSummary& input, Options& options);

/// The goal that a grid has instead of that of all others.
[[nodiscard]] std::optional<Goal> ownGoalOf(const Options& options, const FittedGrid& grid);

/// The PSNR that a grid should reach, dB over the box.
[[nodiscard]] std::optional<double> wantedPsnrOf(const Options& options, const FittedGrid& grid);

}  // namespace esvr::vdb2esvr
