#pragma once
/// Frames and sequences in the options of the programs: ranges of numbers, names of files with a place for the number of a
/// frame, patterns for files with one frame each, files that hold all frames, the options --frames, --missing and --on-error, and what is said about frames.

#include <cstddef>
#include <cstdint>
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
#include "programs/run_main.h"

namespace esvr::cli {

// Ranges, in the grammar of the library fileseq.

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

// Patterns in names of files.

/// What a folder has for a pattern: its frames, and names that look like frames and are none.
struct FrameListing {
  std::vector<FrameNumber> frames;  ///< increasing
  /// Numbers in names with another number of digits, which are no frames, increasing.
  std::vector<FrameNumber> others;
  std::filesystem::path exampleOfOthers;  ///< the first of their files by name
  /// A pattern that takes the frames and the others; empty if there is none.
  std::string patternOfAll;
  /// Names such as a.1001.50.vdb, in which Houdini writes the substeps of a frame.
  std::size_t substeps = 0;
  std::filesystem::path exampleOfSubsteps;
  std::string patternOfSubsteps;   ///< takes the substeps of the example's fraction
  std::filesystem::path tooLarge;  ///< a name with a number that no frame has; empty: none

  /// Says which names look like frames and are none, and how to read them; empty if there are none.
  /// \param wanted  the numbers in question; null: all
  [[nodiscard]] std::string hint(const std::vector<FrameNumber>* wanted = nullptr) const;
};

/// A path in which a pattern stands for the number of a frame:
///
///     #                    four digits: smoke.#.vdb is smoke.0007.vdb
///     ##, ###, ####, ...   as many digits
///     @, @@, @@@, ...      as many digits
///     %04d, %d             as many digits as in printf; %d is one digit
///     $F4, $F              as many digits as in Houdini; $F is one digit
///
/// Smaller numbers begin with zeros, larger ones have more digits. A minus takes the place of a
/// digit, as in printf: "-001". If a name has several patterns, the last one stands for the frame,
/// and the others for themselves.
///
/// A path that a pattern gives for a frame belongs to this frame only: smoke.@.vdb is smoke.7.vdb,
/// and smoke.0007.vdb does not match it. The one exception are negative frames as Blender numbers
/// them: where there is no "-002", "-0002" is read as frame -2 of ####.
class FramePattern {
 public:
  /// The pattern in the last part of a path, as outputs have it; nothing if there is none. Folders
  /// stand for themselves.
  /// \throws UsageError  it asks for more than 32 digits
  [[nodiscard]] static std::optional<FramePattern> in(const std::string& path);

  /// The pattern in the path of an input. It may be in the name of a folder too, of which the last
  /// one with a pattern counts. A file or folder that exists under its very name is no pattern.
  /// \return nothing if there is none
  /// \throws UsageError  it asks for more than 32 digits
  [[nodiscard]] static std::optional<FramePattern> ofInput(const std::string& path);

  /// A path without a pattern, which all frames have in common.
  [[nodiscard]] static FramePattern whole(const std::string& path);
  [[nodiscard]] bool isWhole() const { return pattern_.empty(); }

  /// The path of a frame.
  [[nodiscard]] std::filesystem::path at(FrameNumber frame) const;

  /// The path of a frame that is read: as at(), or in Blender's form if only that exists.
  [[nodiscard]] std::filesystem::path toRead(FrameNumber frame) const;

  /// The frames whose paths exist, and what looks like frames.
  [[nodiscard]] FrameListing onDisk() const;

  /// The path with the pattern.
  [[nodiscard]] const std::string& text() const { return text_; }
  /// The pattern alone, for example "####"; empty for a whole path.
  [[nodiscard]] const std::string& pattern() const { return pattern_; }
  /// The folder of the file or folder whose name has the pattern, or of a whole path.
  [[nodiscard]] std::filesystem::path folder() const;

 private:
  FramePattern() = default;
  /// The last pattern in a part of a path, which begins and ends at these places.
  static std::optional<FramePattern> inPart(const std::string& path, std::size_t begin,
                                            std::size_t end);
  [[nodiscard]] std::string digitsOf(FrameNumber frame) const;
  [[nodiscard]] std::string blenderDigitsOf(FrameNumber frame) const;
  /// The entries of the folder whose names have a number in the pattern's place.
  struct Entry;
  [[nodiscard]] std::vector<Entry> entries() const;
  /// A pattern of this number of digits at least, if it takes all entries, each as another frame.
  [[nodiscard]] std::string patternOfAll(const std::vector<Entry>& all, std::size_t digits) const;

  std::string text_, pattern_;
  std::string before_, after_;  ///< parts of the path before and after the pattern
  std::size_t digits_ = 1;
};

// ---- Sequences

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

/// The sides of a program that may be a path without a pattern.
struct WholeFiles {
  bool input = false, output = false;  ///< a file with all frames
  bool outputOfOneFrame = false;       ///< a file of the single frame that --frames names
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
