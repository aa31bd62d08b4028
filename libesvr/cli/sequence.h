#pragma once
/// Sequences of files, one for each frame, in the options of the converters: patterns as input and
/// output, and the options --frames, --missing and --on-error.

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/command_line.h"
#include "cli/frame_pattern.h"
#include "cli/frame_range.h"

namespace esvr::cli {

/// What happens to frames that --frames names and that are not on the disk.
enum class MissingFrame {
  kError,  ///< nothing is converted
  kHold,   ///< the output of the frame before it is repeated
  kSkip    ///< they have no output
};

/// What happens after a frame could not be converted.
enum class OnFrameError { kContinue, kStop };

struct Sequence {
  FramePattern input, output;
  std::optional<std::vector<FrameNumber>> frames{};  ///< nothing: all frames on the disk
  MissingFrame missing = MissingFrame::kError;
  OnFrameError onError = OnFrameError::kContinue;
};

/// Adds the options.
void addSequenceOptions(po::options_description& options);

/// Reads the options and the arguments `input` and `output`, which were given. An input that exists
/// under its very name is a file, even if the name has a pattern.
/// \return nothing if the input is a file
/// \throws UsageError  the output has no pattern, although the input has one; one of the options is
///                     invalid, or was given for a file
[[nodiscard]] std::optional<Sequence> readSequence(const Arguments& arguments);

/// A frame of a sequence.
struct Frame {
  FrameNumber number = 0;
  std::filesystem::path input{}, output{};
  bool missing = false;
  std::optional<std::size_t> holds{};  ///< index of the frame whose output this missing one repeats
};

/// The frames of a sequence in the order in which they are named.
/// \throws BadInput  no frame exists; or frames are missing, and MissingFrame::kError is wanted, or
///                   there is no frame to hold. The text names them
[[nodiscard]] std::vector<Frame> planFrames(const Sequence& sequence);

/// The frames that hold a frame, by the index of that frame.
[[nodiscard]] std::multimap<std::size_t, std::size_t> holdersOf(const std::vector<Frame>& frames);

struct FrameOutputRules {
  std::initializer_list<std::string_view> extensions;  ///< those that an output may have
  bool mayExist = false;                               ///< outputs that exist are no error
};

/// Checks before the work begins that the outputs of all frames can be written.
/// \throws UsageError  the extension is another one; a frame's output is its input
/// \throws RuntimeFailure  outputs exist, but may not; the folder is not writable
void checkFrameOutputs(const Sequence& sequence, const std::vector<Frame>& frames,
                       const FrameOutputRules& rules);

}  // namespace esvr::cli
