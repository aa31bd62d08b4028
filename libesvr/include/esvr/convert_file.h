#pragma once
/// Converts the grids of a file together, as vdb2esvr does: grids of equal voxels once, vectors as three
/// components of one scale, all grids with the best quality for a size of the file, and voxels that refer to
/// those of a grid that is like them.
///
///     writeEsvr("smoke.esvr", convertGrids(readSources("smoke.vdb")).file);

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/encode.h"
#include "esvr/grid.h"
#include "esvr/vdb_io.h"

namespace esvr {

// What is converted.

/// A grid of numbers, or a component of a grid of vectors. It is read whenever it is needed, so that few
/// grids are in memory at the same time.
struct GridSource {
  std::string name;       ///< of the grid; of a component: of the vectors
  std::size_t place = 0;  ///< number of grids before it in its file; components have the same
  std::uint64_t activeVoxels = 0, storedBytes = 0;  ///< GridSummary
  Box activeBox;
  std::function<VolumeGrid()> read;
  std::optional<Goal> goal{};  ///< instead of that of all grids
  /// Of a component: 0, 1 or 2. The three components follow each other and agree in class, type and transform.
  std::optional<std::size_t> component{};
  /// Of component 0: reads all components at once. Empty: they are read one by one.
  std::function<VectorGrid()> readVector{};
  /// Of component 0: reads the bytes of the vectors, which the file holds where the components would take
  /// more. Empty: it always has the components.
  std::function<CarriedGrid()> readCarried{};

  /// The name by which it is stored: `name`, or componentName() of it.
  [[nodiscard]] std::string storedName() const;
};

/// All that a file is to hold.
struct FileSource {
  std::vector<MetaItem> metadata{};
  std::vector<GridSource> grids{};  ///< by increasing places
  std::vector<CarriedGrid>
      carried{};  ///< grids that are kept unchanged; CarriedGrid::place is that of GridSource
};

/// The grids of a file as indices of VdbSummary::grids, increasing.
struct FileChoice {
  std::vector<std::size_t> converted, carried;
};

/// Why a grid of a file is carried and not converted; empty if it is converted. Without loss, doubles are
/// carried, because a converted grid has floats.
[[nodiscard]] std::string whyCarried(const GridSummary& grid, bool lossless);

/// The chosen grids of a .vdb or .nvdb file. Those that are carried are read at once.
/// \param read  its limit of memory is reduced by the carried grids
/// \throws BadInput, MemoryExceeded  as for readCarried
[[nodiscard]] FileSource readSources(const std::filesystem::path& path, const VdbSummary& summary,
                                     const FileChoice& choice, ReadOptions read = {});

/// All grids of a file. Those that cannot be converted are carried.
/// \param lossless  carries the grids of doubles, and those with inactive values that a converted grid loses
/// \throws BadInput  a grid can be neither converted nor carried (the text names it); as for inspectVdb
[[nodiscard]] FileSource readSources(const std::filesystem::path& path, bool lossless = false,
                                     const ReadOptions& read = {});

// How it is converted.

/// What decides the conversion of a grid besides the options that all grids have in common. Grids with the
/// same key are converted once.
struct SourceKey {
  InputKey voxels;
  std::optional<double> peak{}, range{};  ///< of vectors: peakOfVectors() and valueRangeOfVectors()
  std::optional<Goal> goal{};             ///< GridSource::goal
  double narrowing = 0.0;                 ///< Narrowing::largest(), which a bound has to allow for
  friend auto operator<=>(const SourceKey&, const SourceKey&) = default;
};

/// A converted grid of a file.
struct GridConversion {
  std::size_t source = 0;  ///< index in FileSource::grids
  std::size_t convertedAs =
      0;  ///< the source that was converted: its own, or one with the same key
  Conversion conversion{};
  std::optional<PaperRecord> paper{};  ///< with FileOptions::paper
  SourceKey key{};
  std::optional<std::size_t> twinOf{};  ///< `convertedAs` if that is another grid of the file
  bool asBefore = false;                ///< it is the grid of the previous frame
  std::size_t bricks = 0;               ///< of the source, as the next two
  std::uint64_t nonFiniteReplaced = 0;  ///< with NonFinite::kValue or kBackground
  InactiveValues inactive{};
  double secondsRead = 0.0, secondsConvert = 0.0;

  /// What a grid of voxels gains by the other grids of the file; nothing if it shares nothing.
  struct Shared {
    std::optional<std::size_t> with{};              ///< source of the grid that it refers to
    std::uint64_t bytesWith = 0, bytesWithout = 0;  ///< bytesAdded
    double seconds = 0.0;                           ///< that the search for it took
  };
  std::optional<Shared> shared{};
};

/// A step of a conversion that reads a grid, and usually converts it.
struct GridStep {
  std::size_t grid = 0;  ///< index in FileSource::grids
  bool isAlone = true;   ///< false: on several threads at the same time
  /// Options of the fits, to which progress may be added. If `run` fails, another device may be chosen for
  /// this grid and all later ones, and the step run again.
  FitOptions& fit;
  const std::function<void()>& run;
};

/// What a conversion knows of a grid of the frame before, and a reader does not: GridConversion::key, and how its
/// ellipsoids were rounded.
struct GridBefore {
  SourceKey
      key;  ///< a grid with the same one is that of the frame before, so that a scene that stands still does not change
  std::optional<CompactRecord> compact{};
};

/// The frame before in a sequence, as a reader gets it.
struct FrameBefore {
  const EsvrFile* file = nullptr;       ///< null: there is none
  std::span<const GridBefore> grids{};  ///< those of the file, in their order
  double abovePreset = 0.0;             ///< ConvertedFile::abovePreset
};

struct FileOptions {
  /// The options and the goal of all grids; by default those of vdb2esvr. A size of a single grid is no goal
  /// for a file.
  ConvertOptions convert{.goal = PresetGoal{}};
  /// Largest size of the file, bytes, which replaces all goals. A file of one grid has a SizeGoal. The grids of
  /// other files, and of frames with a frame before them, have the highest PresetGoal::abovePreset with which the file is
  /// not larger, of some conversions that come near to the size. A file without grids has no size.
  std::optional<std::uint64_t> size{};
  bool shares =
      true;  ///< voxels may refer to those of another grid, and small sections share a row
  /// False: one grid after the other, as where several processes share the fits.
  bool severalAtOnce = true;
  std::optional<PaperMethod> paper{};  ///< the paper's method instead of convertVolume()
  FrameBefore previous{};
  /// Calls GridStep::run. A program that has it can add to what the step throws. Empty: it is only called.
  std::function<void(const GridStep&)> onStep{};
  /// Is told of each conversion while its source is in memory, in the step, and again if the grid is
  /// converted again.
  std::function<void(const VolumeGrid& source, const GridConversion&)> onConverted{};
};

/// A grid of vectors that the file holds as bytes, because those are fewer.
struct CarriedVector {
  std::size_t place = 0;    ///< GridSource::place
  std::uint64_t bytes = 0;  ///< that the components would take
};

struct ConvertedFile {
  EsvrFile file;
  std::vector<GridConversion> grids;  ///< those of `file`, in their order
  std::vector<CarriedVector> carriedVectors;
  /// The conversion was cancelled; grids and vectors that were not complete are left out.
  bool interrupted = false;
  /// It was cancelled before a file was found that keeps to the size; this is the smallest one so far.
  bool isTooLarge = false;
  bool isShared = false;     ///< the grids were compared with each other
  double abovePreset = 0.0;  ///< PresetGoal::abovePreset of grids that keep to a size, about
};

/// Converts the grids of a file. The result is as deterministic as convertVolume(). A cancelled call
/// (FitOptions::cancel, or the token of the thread) returns the grids that are complete; of a size, those of
/// the best file that keeps to it, or else of the smallest one (ConvertedFile::isTooLarge).
/// \throws UsageError  no file of the size was found; as for convertVolume
/// \throws  what the sources throw, and as for convertVolume
[[nodiscard]] ConvertedFile convertGrids(FileSource source, const FileOptions& options = {});

/// Bytes that a written file would take if its grids shared nothing but equal sections: each section would
/// have a row of the table, and each grid a record and voxels of its own.
[[nodiscard]] std::uint64_t bytesWithoutSharing(const ConvertedFile& converted,
                                                const EsvrSummary& written);

}  // namespace esvr
