#pragma once
/// Chooses the grids of a file that are fitted, those that are carried unchanged, and those that
/// are left out.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esvr/grid.h"
#include "esvr/vdb_io.h"

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

/// The names of the grids of a file, by which options name them.
[[nodiscard]] GridNames namesOf(const VdbSummary& file);

/// A file without any grid is a valid choice of none; a program for simulations may begin so.
/// \throws BadInput  a named grid does not exist or its name is ambiguous (the text lists the grids); a
///                   grid can be neither fitted nor carried; or no grid of a file that has some is left
/// \throws UsageError  a grid is named by --skip and by another option
[[nodiscard]] GridChoice chooseGrids(const std::filesystem::path& file, const VdbSummary& summary,
                                     const WantedGrids& wanted);

}  // namespace esvr::vdb2esvr
