#include "vdb2esvr/progress_bar.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/printable.h"

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
  std::string line = cli::printable(grid) + "  " + std::to_string(std::lround(100.0 * fraction)) +
                     " % " + bar(fraction) + numbers + parts + clock(progress.secondsLeft) +
                     " left";
  line.resize(std::min(line.size(), width));
  return line;
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
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
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

ProgressBar::~ProgressBar() {
  if (form_ == Form::kBar) std::cerr << kBackAndClear << std::flush;
}

void ProgressBar::redraw(const FitProgress& progress) const {
  const std::size_t width = terminalWidth() - 1;  // a full line would wrap
  std::cerr << kBackAndClear << progressLine(grid_, progress, width) << std::flush;
}

void ProgressBar::printLine(const FitProgress& progress) {
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

}  // namespace esvr::vdb2esvr
