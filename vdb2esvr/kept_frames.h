#pragma once
/// What a sequence keeps of an earlier run that was interrupted (--resume): the frames whose inputs have not changed
/// since, and in a file for all frames the groups that are complete.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "esvr/sequence_file.h"
#include "programs/sequence.h"

namespace esvr::vdb2esvr {

// The groups of one file.

/// The indices of the frames of a group.
using PlannedGroup = std::vector<std::size_t>;

/// Divides frames with increasing numbers into groups of kGroupFrames; the last one may have fewer. A
/// frame that holds another one is in the group of that frame. Frames that
/// are left out are in no group.
[[nodiscard]] std::vector<PlannedGroup> planGroups(const std::vector<cli::Frame>& frames);

/// What a run that continues another one keeps of its partial file.
struct KeptGroups {
  std::size_t planned = 0;  ///< number of planned groups that are complete
  std::size_t stored = 0;   ///< number of groups of the partial file that hold them
};

/// Finds the planned groups that a partial file has completely. A planned group may be several
/// groups of the file. It may lack frames that could not be converted, if the file has frames of a
/// later group.
/// \param stored  the frames of the partial file
/// \throws UsageError  the partial file has frames or groups that are not planned
[[nodiscard]] KeptGroups keptGroups(const std::vector<cli::Frame>& frames,
                                    const std::vector<PlannedGroup>& planned,
                                    const std::vector<SequenceFrame>& stored);

// The inputs.

/// True if an output is older than what it is made of: the input of its frame, or the output of the frame that it
/// holds.
[[nodiscard]] bool isOlder(const std::filesystem::path& output,
                           const std::filesystem::path& madeOf);

/// The size and the time of the last change, by which build tools compare files; contents would have to be read.
struct InputState {
  std::uint64_t bytes = 0;
  std::int64_t changed = 0;
  friend bool operator==(const InputState&, const InputState&) = default;
};

/// That of the input of a frame; of zeros if it has none, because it holds another frame.
[[nodiscard]] InputState stateOf(const cli::Frame& frame);

/// What the inputs of the frames in OUT.esvr.partial were when they were read. As the format holds no times,
/// OUT.esvr.partial.inputs has them, in a line for each frame.
class FrameInputs {
 public:
  /// \param partial    OUT.esvr.partial
  /// \param continues  reads what an earlier run has left; otherwise this is removed
  FrameInputs(const std::filesystem::path& partial, bool continues);

  [[nodiscard]] static std::filesystem::path pathFor(const std::filesystem::path& partial);

  /// True if the frame was converted from the input that it has now.
  [[nodiscard]] bool haveThatOf(const cli::Frame& frame) const;

  /// Adds a frame. This comes before its group is appended, since the process may be killed between both.
  /// \throws RuntimeFailure  the file is not writable
  void add(const cli::Frame& frame, const InputState& state);

  /// Removes the file: the sequence is complete.
  void remove();

 private:
  std::filesystem::path path_;
  std::map<cli::FrameNumber, InputState> states_;
};

/// Keeps the groups before that of the first frame whose input has changed. Those behind it follow it in the file and
/// may refer to it.
/// \return that frame; nothing if no input has changed
[[nodiscard]] std::optional<cli::Frame> keepUnchanged(const FrameInputs& inputs,
                                                      const std::vector<cli::Frame>& frames,
                                                      const std::vector<PlannedGroup>& planned,
                                                      const std::vector<SequenceFrame>& stored,
                                                      KeptGroups& kept);

}  // namespace esvr::vdb2esvr
