#include "compare/frame_source.h"

#include <filesystem>
#include <system_error>

#include "cli/sequence.h"
#include "esvr/error.h"

namespace esvr::compare {

namespace fs = std::filesystem;

std::unique_ptr<FrameSource> FrameSource::in(const std::string& path,
                                             const cli::HostMemory& memory) {
  std::error_code unreadable;  // whoever opens the file reports the reason
  const auto stored = cli::framesInFile(path);
  const auto pattern = fs::exists(path, unreadable) ? std::nullopt : cli::FramePattern::in(path);
  if (!stored && !pattern) return nullptr;
  std::unique_ptr<FrameSource> source(
      new FrameSource(pattern ? *pattern : cli::FramePattern::whole(path), memory));
  source->numbers_ = stored ? *stored : pattern->onDisk();
  if (source->numbers_.empty()) throw BadInput("no file matches " + path);
  if (stored)
    source->reader_ =
        std::make_unique<SequenceReader>(path, ReadLimits{memory.maxBytes, memory.voxels});
  return source;
}

GridFile FrameSource::open(cli::FrameNumber number) {
  const fs::path path = pattern_.at(number);
  if (!reader_) return GridFile(path, memory_);
  return GridFile(path, reader_->read(number), memory_);
}

std::uint64_t FrameSource::bytesOf(const std::vector<cli::FrameNumber>& frames) const {
  if (reader_) return reader_->fileBytes();
  std::uint64_t bytes = 0;
  for (const cli::FrameNumber frame : frames) bytes += fs::file_size(pattern_.at(frame));
  return bytes;
}

}  // namespace esvr::compare
