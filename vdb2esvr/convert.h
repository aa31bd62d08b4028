#pragma once
/// Reads, converts and measures grids of the input, and says what to do with those that cannot be
/// converted.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/twins.h"

namespace esvr::vdb2esvr {

// Reading.

/// Reads a grid, or a component of a grid of vectors. \throws  as readGrid
[[nodiscard]] VolumeGrid readSource(const Options& options, const FittedGrid& grid);

/// Sets the peak and the range of all components of vectors to peakOfVectors() and
/// valueRangeOfVectors(), for which the vectors are read. \throws  as for readVector
void findScales(const Options& options, std::vector<FittedGrid>& grids);

/// Under --lossless, carries the grids that have inactive values which a converted grid loses.
/// \param warn  is called for grids that cannot be carried
void carryInactiveValues(const Options& options, const std::function<void(std::string)>& warn,
                         GridChoice& choice);

/// The end of the message of a refusal: the option with which the grid is in the output nevertheless,
/// or that leaves it out if there is none.
[[nodiscard]] std::string wayOut(const GridSummary& grid);

/// Runs what reads or converts a grid. A refusal gets the way out at the end of its text.
template <class Body>
auto sayingTheWayOut(const FittedGrid& grid, const Body& body) try {
  return body();
} catch (const NotFinite& error) {
  throw BadInput(error.what() + std::string("; --nonfinite zero replaces them by 0, and") +
                 wayOut(grid.source));
} catch (const CannotConvert& error) {
  throw BadInput(error.what() + std::string(";") + wayOut(grid.source));
} catch (const MemoryExceeded& error) {
  throw MemoryExceeded(error.what() + std::string(";") + wayOut(grid.source));
}

// Converting.

struct PhaseSeconds {
  double read = 0.0, seed = 0.0, optimise = 0.0, encode = 0.0, measure = 0.0;
  [[nodiscard]] double fit() const { return seed + optimise; }
  [[nodiscard]] double total() const { return read + seed + optimise + encode + measure; }
};

/// Errors of the surface of a narrow band.
struct SurfaceErrors {
  SignErrors signs;
  std::optional<MeshDistance> distance{};  ///< nothing if the volume is large
};

/// What a grid of voxels gains by the other grids of the file.
struct SharedBytes {
  std::string with{};  ///< unique name of the grid that it refers to; empty: it refers to none
  std::uint64_t bytesWith = 0, bytesWithout = 0;  ///< bytesAdded
  double seconds = 0.0;                           ///< that the search for it took
};

struct ConvertedGrid {
  std::string uniqueName;  ///< FittedGrid::uniqueName
  std::string sourceName;  ///< GridSummary::uniqueName of the grid of the input
  NamedGrid id;            ///< FittedGrid::id(): its place in the input
  Conversion conversion;
  VolumeMetrics metrics;                 ///< errors of the decoded grid
  std::optional<double> wantedPsnr;      ///< PSNR over the box that the grid should reach, dB
  std::optional<SurfaceErrors> surface;  ///< of a narrow band
  std::string whyNoNarrowBand;           ///< of a level set that is none (whyNoNarrowBand())
  std::size_t bricks = 0;                ///< bricks of the source
  std::uint64_t nonFiniteReplaced = 0;
  InactiveValues inactive;            ///< of the source, which the file does not hold
  std::string device;                 ///< name of the device that fitted the grid
  std::optional<PaperRecord> paper;   ///< record of the paper's method, with --paper
  std::optional<SharedBytes> shared;  ///< nothing if it shares nothing
  std::optional<NamedGrid> twinOf;    ///< id of the grid that this one is a twin of
  std::string sameAs;                 ///< unique name of that grid
  std::optional<SourceKey> source;    ///< the key of what was read, in a group of frames
  bool asBefore = false;              ///< it is the grid of the previous frame
  PhaseSeconds seconds;

  [[nodiscard]] const StoredGrid& stored() const { return conversion.grid; }
};

/// The same grid of the previous frame, which is the one with its number among those that are stored by
/// its name; null if there is none.
[[nodiscard]] const StoredGrid* previousOf(const Options& options, const FittedGrid& fitted);

/// \param source  the grid as it was read
[[nodiscard]] SourceKey sourceKeyOf(const Options& options, const FittedGrid& fitted,
                                    const VolumeGrid& source);

/// Reads, converts and measures a grid. A process that only fits does not measure it.
/// \param bytes  bytes that the grid may add to the file, if a size is wanted
/// \param expected  a grid that is like this one and that its voxels are to refer to; null: the same
///                  grid of the previous frame, if there is one
[[nodiscard]] ConvertedGrid convertGrid(const Options& options, const FittedGrid& fitted,
                                        std::optional<std::uint64_t> bytes,
                                        const StoredGrid* expected = nullptr);

/// A twin of a converted grid, which takes the time of reading it only.
[[nodiscard]] ConvertedGrid twinOf(const ConvertedGrid& grid, const FittedGrid& fitted,
                                   const Twin& twin);

}  // namespace esvr::vdb2esvr
