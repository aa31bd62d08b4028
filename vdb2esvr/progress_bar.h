#pragma once
/// Shows how far a fit or a sequence is: a bar on a terminal, lines in a log, or lines of JSON for
/// programs.

#include <chrono>
#include <string>

#include "esvr/fit.h"
#include "programs/run_main.h"
#include "programs/sequence.h"

namespace esvr::vdb2esvr {

/// kText: on a terminal, one line on stderr that is redrawn, and erased when the bar goes out of
/// scope; if stderr is not a terminal, a line every few seconds with --verbose, else nothing.
/// kJson: lines on stderr that docs/report.md describes.
enum class ProgressForm { kText, kJson };

/// How far a sequence is, when a frame has ended.
struct SequenceProgress {
  cli::FrameNumber frame = 0;  ///< the frame that has ended
  std::string state;           ///< what became of it, as in the report
  std::size_t done = 0, failed = 0, frames = 0;
  double seconds = 0.0;  ///< since the sequence began

  [[nodiscard]] double fraction() const { return double(done) / double(frames); }
  /// As long for each frame as so far.
  [[nodiscard]] double secondsLeft() const {
    return seconds * double(frames - done) / double(done);
  }
};

class ProgressBar {
 public:
  /// \param grid       begins the line; the pattern of a sequence
  /// \param verbosity  kQuiet: no text is shown
  ProgressBar(std::string grid, ProgressForm form, cli::Verbosity verbosity);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(const FitProgress& progress);
  void show(const SequenceProgress& progress);
  /// Erases the line, so that a message can be printed.
  void hide() const;

 private:
  enum class Form { kNone, kBar, kLines, kJson };
  using Clock = std::chrono::steady_clock;

  template <class Progress>
  void redraw(const Progress& progress) const;
  template <class Progress>
  void printLine(const Progress& progress);
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

/// The same for a sequence, for example
/// "smoke.####.vdb  45 % [#########-----------]  45 of 100 frames  1 failed  1:23 left".
[[nodiscard]] std::string progressLine(const std::string& pattern, const SequenceProgress& progress,
                                       std::size_t width);

/// The same as objects of JSON.
[[nodiscard]] std::string progressJson(const std::string& grid, const FitProgress& progress);
[[nodiscard]] std::string progressJson(const SequenceProgress& progress);

}  // namespace esvr::vdb2esvr
