#pragma once
/// Reads grids of the input, and says what to do with those that cannot be converted.

#include <functional>
#include <string>
#include <vector>

#include "esvr/error.h"
#include "esvr/vdb_io.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

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

}  // namespace esvr::vdb2esvr
