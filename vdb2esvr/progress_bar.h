#pragma once
/// How far a fit is, on a terminal.

#include <string>

#include "esvr/fit.h"

namespace esvr::vdb2esvr {

/// One line on stderr that is redrawn and gone when the bar is. Where stderr is no terminal,
/// nothing is drawn.
class ProgressBar {
 public:
  /// \param grid   begins the line
  /// \param shown  false: draws nothing (--quiet)
  ProgressBar(std::string grid, bool shown);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(const FitProgress& progress) const;

 private:
  std::string grid_;
  bool shown_;
};

/// "density  45 % [#########-----------]  51.20 dB  12000 ellipsoids  1:23 left", cut to a width.
[[nodiscard]] std::string progressLine(const std::string& grid, const FitProgress& progress,
                                       std::size_t width);

}  // namespace esvr::vdb2esvr
