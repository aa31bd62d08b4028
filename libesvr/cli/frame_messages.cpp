#include "cli/frame_messages.h"

namespace esvr::cli {

std::string textOf(const Frame& frame) { return "frame " + std::to_string(frame.number); }

std::string sentenceOn(const std::vector<FrameNumber>& numbers, std::size_t all,
                       const std::string& what) {
  return std::to_string(numbers.size()) + " of " + std::to_string(all) + " frames " + what + ": " +
         textOfFrames(numbers);
}

Error failureToHold(const Frame& held, const Error& failure) {
  return {failure.kind(), textOf(held) + ", which it holds, failed"};
}

}  // namespace esvr::cli
