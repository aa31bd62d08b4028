#include "vdb2esvr/progress_bar.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "programs/files.h"

namespace esvr::vdb2esvr {
namespace {

constexpr const char* kBackAndClear = "\r\x1b[K";
constexpr std::size_t kBarCells = 20;
constexpr std::size_t kLogWidth = 200;
constexpr std::chrono::seconds kLineInterval{5}, kJsonInterval{1};

std::size_t terminalWidth() {
  constexpr std::size_t kUnknown = 80;
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : kUnknown;
}

std::string bar(double fraction) {
  const auto filled = std::size_t(std::lround(fraction * double(kBarCells)));
  return '[' + std::string(filled, '#') + std::string(kBarCells - filled, '-') + ']';
}

std::string clock(double seconds) {
  constexpr long kMinute = 60;
  const long whole = std::lround(std::max(seconds, 0.0));
  char text[32];
  std::snprintf(text, sizeof text, "%ld:%02ld", whole / kMinute, whole % kMinute);
  return text;
}

/// The start of a line: a name, a share of the whole, and a bar.
std::string startOfLine(const std::string& name, double fraction) {
  return cli::printable(name) + "  " + std::to_string(std::lround(100.0 * fraction)) + " % " +
         bar(fraction);
}

std::string cut(std::string line, std::size_t width) {
  line.resize(std::min(line.size(), width));
  return line;
}

std::string dumped(const nlohmann::ordered_json& json) {
  constexpr int kOneLine = -1;
  return cli::jsonText(json, kOneLine);
}

}  // namespace

std::string progressLine(const std::string& grid, const FitProgress& progress, std::size_t width) {
  const double fraction = std::clamp(progress.fraction, 0.0, 1.0);
  char numbers[96];
  std::snprintf(numbers, sizeof numbers, "  %.2f dB  %llu ellipsoids  ", progress.point.psnrBox,
                static_cast<unsigned long long>(progress.point.ellipsoids));
  std::string parts;
  if (progress.parts > 1)
    parts = "part " + std::to_string(progress.partsDone) + " of " + std::to_string(progress.parts) +
            "  ";
  return cut(startOfLine(grid, fraction) + numbers + parts + clock(progress.secondsLeft) + " left",
             width);
}

std::string progressLine(const std::string& pattern, const SequenceProgress& progress,
                         std::size_t width) {
  std::string line = startOfLine(pattern, progress.fraction()) + "  " +
                     std::to_string(progress.done) + " of " + std::to_string(progress.frames) +
                     " frames  ";
  if (progress.failed > 0) line += std::to_string(progress.failed) + " failed  ";
  return cut(line + clock(progress.secondsLeft()) + " left", width);
}

std::string progressJson(const std::string& grid, const FitProgress& progress) {
  const nlohmann::ordered_json json{{"grid", grid},
                                    {"fraction", progress.fraction},
                                    {"seconds", progress.point.seconds},
                                    {"seconds_left", progress.secondsLeft},
                                    {"psnr_box", progress.point.psnrBox},
                                    {"ellipsoids", progress.point.ellipsoids},
                                    {"parts_done", progress.partsDone},
                                    {"parts", progress.parts},
                                    {"voxels_per_second", progress.voxelsPerSecond}};
  return dumped(json);
}

std::string progressJson(const SequenceProgress& progress) {
  return dumped({{"frame", progress.frame},
                 {"state", progress.state},
                 {"frames_done", progress.done},
                 {"frames_failed", progress.failed},
                 {"frames", progress.frames},
                 {"fraction", progress.fraction()},
                 {"seconds", progress.seconds},
                 {"seconds_left", progress.secondsLeft()}});
}

ProgressBar::ProgressBar(std::string grid, ProgressForm form, cli::Verbosity verbosity)
    : grid_(std::move(grid)), form_(Form::kNone) {
  if (form == ProgressForm::kJson) {
    form_ = Form::kJson;
    return;
  }
  if (verbosity == cli::Verbosity::kQuiet) return;
  if (isatty(STDERR_FILENO) == 1)
    form_ = Form::kBar;
  else if (verbosity == cli::Verbosity::kVerbose)
    form_ = Form::kLines;
}

ProgressBar::~ProgressBar() { hide(); }

void ProgressBar::hide() const {
  if (form_ == Form::kBar) std::cerr << kBackAndClear << std::flush;
}

template <class Progress>
void ProgressBar::redraw(const Progress& progress) const {
  const std::size_t width = terminalWidth() - 1;  // a full line would wrap
  std::cerr << kBackAndClear << progressLine(grid_, progress, width) << std::flush;
}

template <class Progress>
void ProgressBar::printLine(const Progress& progress) {
  const auto now = Clock::now();
  if (now - lastLine_ < kLineInterval) return;
  lastLine_ = now;
  std::cerr << progressLine(grid_, progress, kLogWidth) << std::endl;
}

void ProgressBar::printJson(const FitProgress& progress) {
  const auto now = Clock::now();
  if (now - lastLine_ < kJsonInterval && progress.partsDone == lastParts_) return;
  lastLine_ = now;
  lastParts_ = progress.partsDone;
  std::cerr << progressJson(grid_, progress) << std::endl;
}

void ProgressBar::show(const FitProgress& progress) {
  if (form_ == Form::kBar) redraw(progress);
  if (form_ == Form::kLines) printLine(progress);
  if (form_ == Form::kJson) printJson(progress);
}

void ProgressBar::show(const SequenceProgress& progress) {
  if (form_ == Form::kBar) redraw(progress);
  if (form_ == Form::kLines) printLine(progress);
  if (form_ == Form::kJson) std::cerr << progressJson(progress) + '\n' << std::flush;
}

}  // namespace esvr::vdb2esvr
