#include "compare/frame_source.h"

#include <filesystem>

#include "cli/sequence.h"
#include "esvr/error.h"

namespace esvr::compare {

namespace fs = std::filesystem;

std::unique_ptr<FrameSource> FrameSource::in(const std::string& path,
                                             const cli::HostMemory& memory) {
  const auto stored = cli::framesInFile(path);
  const auto pattern = cli::FramePattern::ofInput(path);
  if (!stored && !pattern) return nullptr;
  std::unique_ptr<FrameSource> source(
      new FrameSource(pattern ? *pattern : cli::FramePattern::whole(path), memory));
  if (!stored) {
    source->listing_ = cli::framesOnDisk(*pattern);
    return source;
  }
  source->listing_.frames = *stored;
  source->reader_ =
      std::make_unique<SequenceReader>(path, ReadLimits{memory.maxBytes, memory.voxels});
  return source;
}

GridFile FrameSource::open(cli::FrameNumber number) {
  const fs::path path = pattern_.toRead(number);
  if (!reader_) return GridFile(path, memory_);
  return GridFile(path, reader_->read(number), memory_);
}

std::uint64_t FrameSource::bytesOf(const std::vector<cli::FrameNumber>& frames) const {
  if (reader_) return reader_->fileBytes();
  std::uint64_t bytes = 0;
  for (const cli::FrameNumber frame : frames) bytes += fs::file_size(pattern_.toRead(frame));
  return bytes;
}

}  // namespace esvr::compare
