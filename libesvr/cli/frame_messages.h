#pragma once
/// What programs say about the frames of a sequence.

#include <cstddef>
#include <string>
#include <vector>

#include "cli/sequence.h"
#include "esvr/error.h"

namespace esvr::cli {

/// "frame 7".
[[nodiscard]] std::string textOf(const Frame& frame);

/// A sentence on some frames of a sequence, for example "3 of 100 frames failed: 7, 9, 12".
/// \param numbers  increasing
[[nodiscard]] std::string sentenceOn(const std::vector<FrameNumber>& numbers, std::size_t all,
                                     const std::string& what);

/// The failure of a frame that holds a frame which failed.
[[nodiscard]] Error failureToHold(const Frame& held, const Error& failure);

}  // namespace esvr::cli
