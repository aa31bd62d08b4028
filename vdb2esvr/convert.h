#pragma once
/// Chooses the grids of a file that are fitted, carried unchanged and left out, reads them, measures their conversions, and
/// says what to do with those that cannot be converted.

#include <functional>
#include <optional>
#include <string>

#include "esvr/convert_file.h"
#include "esvr/error.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

// Choosing.

/// The names of the grids of a file, by which options name them.
[[nodiscard]] GridNames namesOf(const VdbSummary& file);

/// A file without any grid is a valid choice of none; a program for simulations may begin so.
/// \throws BadInput  a named grid does not exist or its name is ambiguous (the text lists the grids); a
///                   grid can be neither fitted nor carried; or no grid of a file that has some is left
/// \throws UsageError  a grid is named by --skip and by another option
[[nodiscard]] GridChoice chooseGrids(const std::filesystem::path& file, const VdbSummary& summary,
                                     const WantedGrids& wanted);

// Reading.

/// The grids of the input that the file is to hold.
/// \throws BadInput, MemoryExceeded  as for readSources
[[nodiscard]] FileSource sourceOf(const Options& options, const VdbSummary& input,
                                  const GridChoice& choice);

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
  try {
    return body();
  } catch (Error& error) {
    error.nameGrid(shownName(grid.storedName()), grid.uniqueName);
    throw;
  }
} catch (const NotFinite& error) {
  throw BadInput(
      error.what() +
      std::string("; --nonfinite keep stores where they are, zero replaces them by 0, and") +
      wayOut(grid.source));
} catch (const CannotConvert& error) {
  throw BadInput(error.what() + std::string(";") + wayOut(grid.source));
} catch (const MemoryExceeded& error) {
  throw MemoryExceeded(error.what() + std::string(";") + wayOut(grid.source));
}

// Measuring.

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

struct ConvertedGrid : GridConversion {
  std::string uniqueName;  ///< FittedGrid::uniqueName
  std::string sourceName;  ///< GridSummary::uniqueName of the grid of the input
  NamedGrid id;            ///< its place in the input
  VolumeMetrics metrics;   ///< errors of the decoded grid
  double narrowingOfRange =
      0.0;                  ///< largest error of its doubles as floats, as a share of their range
  bool isBoxEmpty = false;  ///< no active voxel is in the box of --box
  std::optional<double> wantedPsnr;      ///< PSNR over the box that the grid should reach, dB
  std::optional<SurfaceErrors> surface;  ///< of a narrow band
  std::string whyNoNarrowBand;           ///< of a level set that is none (whyNoNarrowBand())
  std::string device;                    ///< name of the device that fitted the grid
  std::string sharesWith;  ///< unique name of the grid that its voxels refer to; empty: of none
  std::string sameAs;      ///< unique name of the grid that it is a twin of
  PhaseSeconds seconds;

  [[nodiscard]] const StoredGrid& stored() const { return conversion.grid; }
};

/// Measures a conversion of a grid, and adds what the report says about it. A process that only fits does
/// not measure.
/// \param device  that fitted the grid
[[nodiscard]] ConvertedGrid measured(const Options& options, const FittedGrid& fitted,
                                     const VolumeGrid& source, const GridConversion& made,
                                     const Device& device);

/// Measures the errors of vectors of the written file.
[[nodiscard]] VectorMetrics measureVector(const Options& options, const EsvrFile& file,
                                          const StoredVector& vector, std::size_t place);

}  // namespace esvr::vdb2esvr
