#pragma once
/// Sequences in the options of the programs: patterns for files with one frame each, files that
/// hold all frames, and the options --frames, --missing and --on-error.

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
#include "cli/log.h"

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
  FramePattern input, output;                        ///< a whole path is a file with all frames
  std::optional<std::vector<FrameNumber>> frames{};  ///< nothing: all frames that there are
  /// The frames of an input that holds them all, increasing; nothing: each is a file.
  std::optional<std::vector<FrameNumber>> stored{};
  MissingFrame missing = MissingFrame::kError;
  OnFrameError onError = OnFrameError::kContinue;
};

/// The sides of a program that may be a file with all frames.
struct WholeFiles {
  bool input = false, output = false;
};

/// Adds the options.
void addSequenceOptions(po::options_description& options);

/// The numbers of the frames that a file holds; nothing if it is no .esvr file of a sequence.
/// \throws BadInput  the file is damaged
[[nodiscard]] std::optional<std::vector<FrameNumber>> framesInFile(
    const std::filesystem::path& path);

/// Reads the options and the arguments `input` and `output`, which were given. An input that exists
/// under its very name is a file, even if the name has a pattern.
/// \return nothing if the input is a file of one frame
/// \throws UsageError  the output needs a pattern and has none; one of the options is invalid, or
///                     was given for a file of one frame
/// \throws BadInput  as for framesInFile
[[nodiscard]] std::optional<Sequence> readSequence(const Arguments& arguments, WholeFiles allowed);

/// The frames of a pattern.
/// \throws BadInput  there are none; the text names what looks like frames
[[nodiscard]] FrameListing framesOnDisk(const FramePattern& input);

/// A frame of a sequence.
struct Frame {
  FrameNumber number = 0;
  std::filesystem::path input{}, output{};
  bool missing = false;
  std::optional<std::size_t> holds{};  ///< index of the frame whose output this missing one repeats
};

/// The frames of a sequence in the order in which they are named, or by increasing numbers if the
/// output is one file. A warning says which names look like frames and are none.
/// \throws BadInput  no frame exists; or frames are missing, and MissingFrame::kError is wanted, or
///                   there is no frame to hold. The text names them
[[nodiscard]] std::vector<Frame> planFrames(const Sequence& sequence, const Log& log);

/// The frames that hold a frame, by the index of that frame.
[[nodiscard]] std::multimap<std::size_t, std::size_t> holdersOf(const std::vector<Frame>& frames);

struct FrameOutputRules {
  std::initializer_list<std::string_view> extensions;  ///< those that an output may have
  bool mayExist = false;                               ///< outputs that exist are no error
  std::vector<std::filesystem::path> moreInputs{};     ///< other files that the run reads
  std::vector<std::filesystem::path> moreOutputs{};    ///< other files that it writes: its report
};

/// The files that an input stands for: the file of that name, or those of all frames of a pattern.
[[nodiscard]] std::vector<std::filesystem::path> filesOfInput(const std::string& input);

/// Checks before the work begins that the outputs of all frames can be written.
/// \throws UsageError  the extension is another one; as for requireSeparate, of all files of the run
/// \throws RuntimeFailure  outputs exist, but may not; the folder is not writable
void checkFrameOutputs(const Sequence& sequence, const std::vector<Frame>& frames,
                       const FrameOutputRules& rules);

}  // namespace esvr::cli
