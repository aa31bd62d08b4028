#pragma once
/// Shows how far a fit is: a bar on a terminal, lines in a log, or lines of JSON for programs.

#include <chrono>
#include <string>

#include "cli/log.h"
#include "esvr/fit.h"

namespace esvr::vdb2esvr {

/// kText: on a terminal, one line on stderr that is redrawn, and erased when the bar goes out of
/// scope; if stderr is not a terminal, a line every few seconds with --verbose, else nothing.
/// kJson: lines on stderr that docs/report.md describes.
enum class ProgressForm { kText, kJson };

class ProgressBar {
 public:
  /// \param grid       begins the line
  /// \param verbosity  kQuiet: no text is shown
  ProgressBar(std::string grid, ProgressForm form, cli::Verbosity verbosity);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(const FitProgress& progress);

 private:
  enum class Form { kNone, kBar, kLines, kJson };
  using Clock = std::chrono::steady_clock;

  void redraw(const FitProgress& progress) const;
  void printLine(const FitProgress& progress);
  void printJson(const FitProgress& progress);

  std::string grid_;
  Form form_;
  Clock::time_point lastLine_ = Clock::now();
  std::size_t lastParts_ = 0;
};

/// The text of the line, cut to a width, for example
/// "density  45 % [#########-----------]  51.20 dB  12000 ellipsoids  1:23 left".
[[nodiscard]] std::string progressLine(const std::string& grid, const FitProgress& progress,
                                       std::size_t width);

/// The same as an object of JSON.
[[nodiscard]] std::string progressJson(const std::string& grid, const FitProgress& progress);

}  // namespace esvr::vdb2esvr
