#include "cli/frame_warnings.h"

#include <vector>

#include "cli/frame_messages.h"

namespace esvr::cli {

void FrameWarnings::add(FrameNumber frame, const std::string& text) {
  const std::lock_guard lock(mutex_);
  frames_[text].insert(frame);
}

Log FrameWarnings::logOf(const Frame& frame, const std::string& program, Verbosity verbosity) {
  return {program + ": " + textOf(frame), verbosity,
          [this, number = frame.number](const std::string& text) { add(number, text); }};
}

void FrameWarnings::tell(const Log& log) const {
  for (const auto& [text, frames] : frames_)
    log.warning((frames.size() == 1 ? "frame " : "frames ") +
                textOfFrames(std::vector(frames.begin(), frames.end())) + ": " + text);
}

}  // namespace esvr::cli
