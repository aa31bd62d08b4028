#include "cli/frame_range.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "cli/number.h"
#include "esvr/error.h"

namespace esvr::cli {
namespace {

constexpr std::size_t kMostFrames = 1'000'000;

/// Frames from `first` to `last`. `kind` is 'x', 'y' or ':'.
struct FrameRange {
  FrameNumber first = 0, last = 0;
  char kind = 'x';
  FrameNumber step = 1;

  /// The number of frames without the step.
  [[nodiscard]] FrameNumber length() const { return std::abs(last - first) + 1; }
  /// The i-th frame without the step.
  [[nodiscard]] FrameNumber at(FrameNumber i) const { return last < first ? first - i : first + i; }
};

/// Takes a number from the start of a text.
std::optional<FrameNumber> takeNumber(std::string_view& text) {
  FrameNumber number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || !isFrameNumber(number)) return std::nullopt;
  text.remove_prefix(std::size_t(end - text.data()));
  return number;
}

/// Takes one of some characters from the start of a text.
std::optional<char> takeOneOf(std::string_view& text, std::string_view characters) {
  if (text.empty() || characters.find(text.front()) == std::string_view::npos) return std::nullopt;
  const char taken = text.front();
  text.remove_prefix(1);
  return taken;
}

/// Takes the kind and the step after a range. \return whether they are valid; both may be missing
bool takeStep(std::string_view& text, FrameRange& range) {
  const auto kind = takeOneOf(text, "xy:");
  if (!kind) return true;
  const auto step = takeNumber(text);
  if (!step || *step < 1) return false;
  range.kind = *kind, range.step = *step;
  return true;
}

std::optional<FrameRange> parseRange(std::string_view text) {
  const auto first = takeNumber(text);
  if (!first) return std::nullopt;
  FrameRange range{*first, *first};
  if (takeOneOf(text, "-")) {
    const auto last = takeNumber(text);
    if (!last) return std::nullopt;
    range.last = *last;
    if (!takeStep(text, range)) return std::nullopt;
  }
  return text.empty() ? std::optional(range) : std::nullopt;
}

/// A list that has every frame once.
class FrameList {
 public:
  explicit FrameList(const std::string& option) : option_(option) {}

  void add(const FrameRange& range) {
    if (range.kind == 'y') return addLeftOut(range);
    if (range.kind == 'x') return addEvery(range, range.step);
    // A step larger than the range names its first frame only.
    for (FrameNumber step = std::min(range.step, range.length()); step > 0; --step)
      addEvery(range, step);
  }
  [[nodiscard]] std::vector<FrameNumber> take() { return std::move(frames_); }

 private:
  void addEvery(const FrameRange& range, FrameNumber step) {
    for (FrameNumber i = 0; i < range.length(); i += step) add(range.at(i));
  }
  void addLeftOut(const FrameRange& range) {
    if (range.step == 1) return;
    for (FrameNumber i = 0; i < range.length(); ++i)
      if (i % range.step != 0) add(range.at(i));
  }
  void add(FrameNumber frame) {
    if (!known_.insert(frame).second) return;
    if (frames_.size() == kMostFrames)
      throw UsageError("--" + option_ + " names more than " + std::to_string(kMostFrames) +
                       " frames");
    frames_.push_back(frame);
  }

  const std::string& option_;
  std::vector<FrameNumber> frames_;
  std::unordered_set<FrameNumber> known_;
};

/// The end of the consecutive frames that begin at an index.
std::size_t endOfRun(const std::vector<FrameNumber>& frames, std::size_t begin) {
  std::size_t end = begin + 1;
  while (end < frames.size() && frames[end] == frames[end - 1] + 1) ++end;
  return end;
}

}  // namespace

std::vector<FrameNumber> parseFrames(const std::string& option, const std::string& text) {
  FrameList list(option);
  for (const auto& part : splitText(text, ',')) {
    const auto range = parseRange(part);
    if (!range)
      throw UsageError("--" + option + ": '" + part +
                       "' is no range of frames; ranges are, for example, 1-100, 1-100x2 or "
                       "1-10,20-30");
    list.add(*range);
  }
  auto frames = list.take();
  if (frames.empty()) throw UsageError("--" + option + ": '" + text + "' names no frame");
  return frames;
}

std::string textOfFrames(const std::vector<FrameNumber>& frames) {
  constexpr std::size_t kMostRuns = 8;
  std::string text;
  std::size_t begin = 0;
  for (std::size_t run = 0; run < kMostRuns && begin < frames.size(); ++run) {
    const std::size_t end = endOfRun(frames, begin);
    text += (text.empty() ? "" : ", ") + std::to_string(frames[begin]);
    if (end - begin > 1) text += "-" + std::to_string(frames[end - 1]);
    begin = end;
  }
  if (begin == frames.size()) return text;
  return text + " and " + std::to_string(frames.size() - begin) + " more";
}

}  // namespace esvr::cli
