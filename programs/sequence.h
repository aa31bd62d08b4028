#pragma once
/// Sequences in the options of the programs: patterns for files with one frame each, files that
/// hold all frames, the options --frames, --missing and --on-error, and what is said about frames.

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "esvr/error.h"
#include "programs/command_line.h"
#include "programs/frames.h"
#include "programs/messages.h"

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

// What programs say about the frames of a sequence.

/// "frame 7".
[[nodiscard]] std::string textOf(const Frame& frame);

/// A sentence on some frames of a sequence, for example "3 of 100 frames failed: 7, 9, 12".
/// \param numbers  increasing
[[nodiscard]] std::string sentenceOn(const std::vector<FrameNumber>& numbers, std::size_t all,
                                     const std::string& what);

/// The failure of a frame that holds a frame which failed.
[[nodiscard]] Error failureToHold(const Frame& held, const Error& failure);

/// Collects the warnings of a sequence, in which many frames have the same ones, so that each is
/// told once with its frames.
class FrameWarnings {
 public:
  /// Notes a warning of a frame. Any thread may call it, also twice for the same warning.
  void add(FrameNumber frame, const std::string& text);

  /// The log of a frame, whose warnings are noted here.
  [[nodiscard]] Log logOf(const Frame& frame, const std::string& program, Verbosity verbosity);

  /// Prints each warning with its frames, in the order of the texts.
  void tell(const Log& log) const;

 private:
  std::mutex mutex_;
  std::map<std::string, std::set<FrameNumber>> frames_;  ///< by the text of the warning
};

/// Copies the output of a frame to that of another one. The copy appears under its name when it is
/// complete.
/// \throws RuntimeFailure  the copy exists (without `overwrite`) or is not writable; the disk is
///                         full
void copyOutput(const std::filesystem::path& from, const std::filesystem::path& to, bool overwrite);

}  // namespace esvr::cli
