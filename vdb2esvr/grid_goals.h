#pragma once
/// Goals that single grids have instead of the goal of all others.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "esvr/convert.h"
#include "vdb2esvr/choose_grids.h"

namespace esvr::vdb2esvr {

struct Options;

struct GridGoal {
  std::string grid;  ///< name in the input; a grid of vectors stands for its components
  Goal goal;
  std::size_t place = 0;  ///< of the grid in the input (resolveNames)
};

/// Reads the values of --psnr and --max-error, such as "40" or "40,density=50": the value without a
/// name is that of all grids that are not named.
/// \throws UsageError  a value is not of this form or out of range; a grid is named twice
void readGridGoals(const cli::Arguments& arguments, Options& options);

/// Finds the places of the grids that options name.
/// \throws BadInput  there is no grid of a name, or it is ambiguous; the text lists the grids
/// \throws UsageError  two goals are those of one grid
void resolveNames(const VdbSummary& input, Options& options);

/// The index in Options::gridGoals of a grid's own goal, if it has one.
[[nodiscard]] std::optional<std::size_t> ownGoalOf(const Options& options, const FittedGrid& grid);

[[nodiscard]] const Goal& goalOf(const Options& options, const FittedGrid& grid);

/// The PSNR that a grid should reach, dB over the box.
[[nodiscard]] std::optional<double> wantedPsnrOf(const Options& options, const FittedGrid& grid);

}  // namespace esvr::vdb2esvr
