#pragma once
/// Ranges of frames in options, in the grammar of the library fileseq.

#include <cstdint>
#include <string>
#include <vector>

namespace esvr::cli {

/// The number of a frame of a sequence; it may be negative.
using FrameNumber = std::int64_t;

/// True if a frame may have the number: sums and differences of such numbers do not overflow.
[[nodiscard]] constexpr bool isFrameNumber(FrameNumber number) {
  constexpr FrameNumber kLargest = 1'000'000'000'000'000;
  return number >= -kLargest && number <= kLargest;
}

/// Parses ranges with commas between:
///
///     7         one frame
///     1-10      all frames from 1 to 10; 10-1 counts down
///     1-10x3    every third frame from 1 on: 1, 4, 7, 10
///     1-10y3    the frames that 1-10x3 leaves out
///     1-10:3    1-10x3, then 1-10x2, then 1-10x1
///     -5--1     negative frames
///
/// \return every frame once, where it is first named
/// \throws UsageError  the text is not of this form, a step is 0, or there are more than a million
///                     frames; the message names the option
[[nodiscard]] std::vector<FrameNumber> parseFrames(const std::string& option,
                                                   const std::string& text);

/// Frames as text, with ranges for consecutive ones: "1-3, 7, 9-12". Long lists end with the number
/// of frames that are left out: "1, 3, 5 and 20 more".
/// \param frames  increasing
[[nodiscard]] std::string textOfFrames(const std::vector<FrameNumber>& frames);

}  // namespace esvr::cli
