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

  /// The numbers of the frames, increasing.
  [[nodiscard]] const std::vector<cli::FrameNumber>& numbers() const { return numbers_; }

  /// Reads a frame. \throws BadInput, MemoryExceeded  as for readEsvr and inspectVdb
  [[nodiscard]] GridFile open(cli::FrameNumber number);

  /// Bytes of some frames; those of a file that holds a sequence are its own.
  [[nodiscard]] std::uint64_t bytesOf(const std::vector<cli::FrameNumber>& frames) const;

 private:
  FrameSource(cli::FramePattern pattern, const cli::HostMemory& memory)
      : pattern_(std::move(pattern)), memory_(memory) {}

  cli::FramePattern pattern_;
  cli::HostMemory memory_;
  std::vector<cli::FrameNumber> numbers_;
  std::unique_ptr<SequenceReader> reader_;  ///< null: each frame is a file
};

}  // namespace esvr::compare
