#pragma once
/// Shows the progress of a fit on a terminal.

#include <string>

#include "esvr/fit.h"

namespace esvr::vdb2esvr {

/// A line on stderr that is redrawn, and removed by the destructor. Nothing is drawn if stderr is
/// not a terminal.
class ProgressBar {
 public:
  /// \param grid   name of the grid, with which the line begins
  /// \param shown  false with --quiet: nothing is drawn
  ProgressBar(std::string grid, bool shown);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(const FitProgress& progress) const;

 private:
  std::string grid_;
  bool shown_;
};

/// The text of the line, cut to a width, for example
/// "density  45 % [#########-----------]  51.20 dB  12000 ellipsoids  1:23 left".
[[nodiscard]] std::string progressLine(const std::string& grid, const FitProgress& progress,
                                       std::size_t width);

}  // namespace esvr::vdb2esvr
