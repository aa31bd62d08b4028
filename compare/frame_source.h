#pragma once
/// The frames of a sequence: a file each, or all in one .esvr file.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/frame_pattern.h"
#include "cli/host_memory.h"
#include "compare/grid_file.h"
#include "esvr/sequence_file.h"

namespace esvr::compare {

class FrameSource {
 public:
  /// The sequence that a path names: a pattern, or a file that holds a sequence.
  /// \return null if the path is that of a single file
  /// \throws BadInput  the file is damaged; no file matches the pattern
  [[nodiscard]] static std::unique_ptr<FrameSource> in(const std::string& path,
                                                       const cli::HostMemory& memory);

  /// Says which names look like frames of the pattern and are none; empty if there are none.
  /// \param wanted  the numbers in question; null: all
  [[nodiscard]] std::string hint(const std::vector<cli::FrameNumber>* wanted) const {
    const std::string text = listing_.hint(wanted);
    return text.empty() ? text : pattern_.text() + ": " + text;
  }

  /// The numbers of the frames, increasing.
  [[nodiscard]] const std::vector<cli::FrameNumber>& numbers() const { return listing_.frames; }

  /// Reads a frame. \throws BadInput, MemoryExceeded  as for readEsvr and inspectVdb
  [[nodiscard]] GridFile open(cli::FrameNumber number);

  /// Bytes of some frames; those of a file that holds a sequence are its own.
  [[nodiscard]] std::uint64_t bytesOf(const std::vector<cli::FrameNumber>& frames) const;

 private:
  FrameSource(cli::FramePattern pattern, const cli::HostMemory& memory)
      : pattern_(std::move(pattern)), memory_(memory) {}

  cli::FramePattern pattern_;
  cli::HostMemory memory_;
  cli::FrameListing listing_;               ///< of a file with all frames: its frames only
  std::unique_ptr<SequenceReader> reader_;  ///< null: each frame is a file
};

}  // namespace esvr::compare
