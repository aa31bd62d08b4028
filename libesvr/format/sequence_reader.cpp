#include <algorithm>

#include "esvr/error.h"
#include "esvr/frame_coding.h"
#include "esvr/sequence_file.h"
#include "format/byte_source.h"
#include "format/sequence_index.h"

namespace esvr {
namespace {

using namespace format;

}  // namespace

bool holdsSequence(const std::filesystem::path& path) {
  return isSequence(readTable(FileSource(path)));
}

class SequenceReader::File {
 public:
  File(const std::filesystem::path& path, const ReadLimits& limits)
      : source_(path), limits_(limits), groups_(readGroups(source_)), frames_(framesOf(groups_)) {
    for (const FrameGroup& group : groups_) {
      firstOf_.push_back(frameCount_);
      frameCount_ += group.frames.size();
    }
  }

  [[nodiscard]] const std::vector<SequenceFrame>& frames() const { return frames_; }
  [[nodiscard]] std::size_t groupCount() const { return groups_.size(); }
  [[nodiscard]] std::uint64_t fileBytes() const { return source_.size(); }
  [[nodiscard]] std::uint64_t bytesRead() const { return source_.bytesRead(); }

  const EsvrFile& read(std::int64_t number) {
    const std::size_t wanted = indexOf(number);
    for (std::size_t i = firstToDecode(wanted); i <= wanted; ++i) decode(i);
    return *decoded_;
  }

  [[nodiscard]] EsvrSummary inspect(std::int64_t number) const {
    return inspectEsvr(bytesOf(indexOf(number)), frameName(source_.name(), number));
  }

 private:
  [[nodiscard]] std::size_t indexOf(std::int64_t number) const {
    const auto at = std::ranges::lower_bound(frames_, number, {}, &SequenceFrame::number);
    if (at == frames_.end() || at->number != number)
      throw BadInput(source_.name() + ": there is no frame " + std::to_string(number));
    return std::size_t(at - frames_.begin());
  }

  /// The frame after the one that was decoded last, if that helps to decode the wanted one;
  /// otherwise the last frame up to the wanted one that refers to no other.
  [[nodiscard]] std::size_t firstToDecode(std::size_t wanted) const {
    std::size_t first = wanted;
    while (frames_[first].dependsOnPrevious && lastDecoded_ != first) --first;
    return lastDecoded_ == first ? first + 1 : first;
  }

  [[nodiscard]] std::vector<std::byte> bytesOf(std::size_t i) const {
    const std::size_t group = frames_[i].group;
    return readFrame(source_, groups_[group], i - firstOf_[group]);
  }

  /// A frame that cannot be decoded leaves none, because it may need the one before it again.
  void decode(std::size_t i) {
    lastDecoded_.reset();
    const bool depends = frames_[i].dependsOnPrevious;
    if (!depends) decoded_.reset();
    // Both frames are in memory until the new one is complete.
    ReadLimits left = limits_;
    if (depends && left.maxBytes != kNoMemoryLimit)
      left.maxBytes -= std::min(left.maxBytes, contentBytes(*decoded_));
    EsvrFile frame = decodeFrame(bytesOf(i), frameName(source_.name(), frames_[i].number), left,
                                 depends ? &*decoded_ : nullptr);
    decoded_ = std::move(frame);
    lastDecoded_ = i;
  }

  FileSource source_;
  ReadLimits limits_;
  std::vector<FrameGroup> groups_;
  std::vector<SequenceFrame> frames_;
  std::vector<std::size_t> firstOf_;  ///< index of the first frame of each group
  std::size_t frameCount_ = 0;
  std::optional<EsvrFile> decoded_;
  std::optional<std::size_t> lastDecoded_;  ///< index of the frame that is decoded
};

SequenceReader::SequenceReader(const std::filesystem::path& path, const ReadLimits& limits)
    : file_(std::make_unique<File>(path, limits)) {}
SequenceReader::~SequenceReader() = default;

const std::vector<SequenceFrame>& SequenceReader::frames() const { return file_->frames(); }
std::size_t SequenceReader::groupCount() const { return file_->groupCount(); }
std::uint64_t SequenceReader::fileBytes() const { return file_->fileBytes(); }
const EsvrFile& SequenceReader::read(std::int64_t number) { return file_->read(number); }
EsvrSummary SequenceReader::inspect(std::int64_t number) { return file_->inspect(number); }
std::uint64_t SequenceReader::bytesRead() const { return file_->bytesRead(); }

}  // namespace esvr
