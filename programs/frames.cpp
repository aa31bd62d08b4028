// Frames in options: ranges of numbers, and names of files with a place for the number of a frame.
#include "programs/frames.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <iterator>
#include <optional>
#include <regex>
#include <set>
#include <string_view>
#include <system_error>
#include <unordered_set>
#include <utility>

#include "esvr/error.h"
#include "programs/files.h"
#include "programs/option_values.h"

namespace esvr::cli {

// Ranges.

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

// Patterns.

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostDigits = 32;
constexpr std::size_t kDigitsOfHash = 4;

/// The number of digits in "%04d" or "$F4"; 1 if there is none.
std::size_t digitsIn(const std::string& pattern) {
  const std::size_t at = pattern.find_first_of("0123456789");
  const auto digits = at == std::string::npos ? std::nullopt : parseLeadingNumber(&pattern[at]);
  // A number that is too large for a std::size_t is refused as well.
  return digits ? std::size_t(std::clamp(digits->value, 1.0, double(kMostDigits + 1))) : 1;
}

std::size_t digitsOfPattern(const std::string& pattern) {
  if (pattern == "#") return kDigitsOfHash;
  const bool isRun = pattern.front() == '#' || pattern.front() == '@';
  return isRun ? pattern.size() : digitsIn(pattern);
}

/// The part of a name between its beginning and its end; nothing if it has others.
std::optional<std::string> between(const std::string& name, const std::string& prefix,
                                   const std::string& suffix) {
  const std::size_t taken = prefix.size() + suffix.size();
  if (name.size() < taken || !name.starts_with(prefix) || !name.ends_with(suffix))
    return std::nullopt;
  return name.substr(prefix.size(), name.size() - taken);
}

/// A text of zeros with a whole number behind them, to which nothing is added if it is longer.
std::string padded(FrameNumber number, std::size_t digits) {
  const std::string text = std::to_string(number);
  return std::string(digits - std::min(digits, text.size()), '0') + text;
}

/// The fraction of a number as Houdini writes it for a substep: ".50" in "1001.50"; empty if the
/// text is none.
std::string fractionIn(const std::string& text) {
  static const std::regex kSubstep(R"(-?[0-9]+(\.[0-9]+))");
  std::smatch found;
  return std::regex_match(text, found, kSubstep) ? found[1].str() : "";
}

bool isNumber(const std::string& text) {
  static const std::regex kNumber("-?[0-9]+");
  return std::regex_match(text, kNumber);
}

}  // namespace

struct FramePattern::Entry {
  std::optional<FrameNumber> frame;  ///< nothing: a substep's, or too large
  std::string digits;                ///< the name's own
  fs::path path;
};

std::string FrameListing::hint(const std::vector<FrameNumber>* wanted) const {
  const std::set<FrameNumber> in(wanted ? wanted->begin() : others.begin(),
                                 wanted ? wanted->end() : others.end());
  std::vector<FrameNumber> numbers;
  std::ranges::copy_if(others, std::back_inserter(numbers),
                       [&](FrameNumber number) { return in.contains(number); });
  std::string text;
  if (!numbers.empty()) {
    text = textOfFrames(numbers) +
           (numbers.size() == 1 ? " looks like a frame and is none: "
                                : " look like frames and are none: ") +
           exampleOfOthers.string() + " has another number of digits than the pattern";
    text += patternOfAll.empty() ? " (# and #### are 4 digits, @ is as many as needed)"
                                 : " (" + patternOfAll + " takes all)";
  }
  if (substeps > 0)
    text += std::string(text.empty() ? "" : "; ") + exampleOfSubsteps.string() +
            (substeps > 1 ? " and " + std::to_string(substeps - 1) + " more look" : " looks") +
            " like a substep of Houdini, and frames have whole numbers; " + patternOfSubsteps +
            " takes the substeps of one fraction";
  if (!tooLarge.empty())
    text += std::string(text.empty() ? "" : "; ") + tooLarge.string() +
            " has a number that is too large for a frame";
  return text;
}

std::optional<FramePattern> FramePattern::inPart(const std::string& path, std::size_t begin,
                                                 std::size_t end) {
  static const std::regex kPattern(R"(#+|@+|%[0-9]*d|\$F[0-9]*)");
  const std::string part = path.substr(begin, end - begin);
  std::optional<std::smatch> last;
  for (std::sregex_iterator at(part.begin(), part.end(), kPattern), none; at != none; ++at)
    last = *at;
  if (!last) return std::nullopt;
  FramePattern made;
  made.text_ = path;
  made.pattern_ = last->str();
  made.before_ = path.substr(0, begin + std::size_t(last->position()));
  made.after_ = path.substr(made.before_.size() + made.pattern_.size());
  made.digits_ = digitsOfPattern(made.pattern_);
  if (made.digits_ > kMostDigits)
    throw UsageError(path + ": the number of a frame has at most " + std::to_string(kMostDigits) +
                     " digits");
  return made;
}

std::optional<FramePattern> FramePattern::in(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return inPart(path, slash == std::string::npos ? 0 : slash + 1, path.size());
}

std::optional<FramePattern> FramePattern::ofInput(const std::string& path) {
  if (isThere(path)) return std::nullopt;
  for (std::size_t end = path.size();;) {
    const std::size_t slash = end == 0 ? std::string::npos : path.rfind('/', end - 1);
    const std::size_t begin = slash == std::string::npos ? 0 : slash + 1;
    if (auto found = inPart(path, begin, end); found && !isThere(path.substr(0, end))) return found;
    if (slash == std::string::npos) return std::nullopt;
    end = slash;
  }
}

FramePattern FramePattern::whole(const std::string& path) {
  FramePattern made;
  made.text_ = made.before_ = path;
  return made;
}

std::string FramePattern::digitsOf(FrameNumber frame) const {
  if (frame >= 0) return padded(frame, digits_);
  return "-" + padded(-frame, digits_ - 1);
}

std::string FramePattern::blenderDigitsOf(FrameNumber frame) const {
  return frame < 0 ? "-" + padded(-frame, digits_) : padded(frame, digits_);
}

fs::path FramePattern::at(FrameNumber frame) const {
  return isWhole() ? text_ : before_ + digitsOf(frame) + after_;
}

fs::path FramePattern::toRead(FrameNumber frame) const {
  fs::path own = at(frame);
  if (isWhole() || frame >= 0 || isThere(own)) return own;
  fs::path blenders = before_ + blenderDigitsOf(frame) + after_;
  return isThere(blenders) ? blenders : own;
}

fs::path FramePattern::folder() const {
  const fs::path start = before_;  // its last part begins the name
  return start.has_parent_path() ? start.parent_path() : fs::path(".");
}

std::vector<FramePattern::Entry> FramePattern::entries() const {
  const std::string prefix = fs::path(before_).filename().string();
  const std::string suffix = after_.substr(0, after_.find('/'));
  std::vector<Entry> found;
  std::error_code unreadable;  // a folder that cannot be read has no files for us
  for (fs::directory_iterator at(folder(), unreadable), end; !unreadable && at != end;
       at.increment(unreadable)) {
    const auto digits = between(at->path().filename().string(), prefix, suffix);
    if (!digits) continue;
    auto frame = parseWhole(*digits);
    if (frame && !isFrameNumber(*frame)) frame.reset();
    if (!frame && fractionIn(*digits).empty() && !isNumber(*digits)) continue;
    Entry entry{frame, *digits, before_ + *digits + after_};
    if (isThere(entry.path)) found.push_back(std::move(entry));  // a link may lead to nothing
  }
  std::ranges::sort(found, {}, &Entry::path);
  return found;
}

FrameListing FramePattern::onDisk() const {
  const std::vector<Entry> all = entries();
  FrameListing listing;
  std::set<FrameNumber> frames, others;
  for (const Entry& entry : all)
    if (entry.frame && entry.digits == digitsOf(*entry.frame)) frames.insert(*entry.frame);
  std::size_t fewestDigits = digits_;
  for (const Entry& entry : all) {
    if (entry.frame && entry.digits == digitsOf(*entry.frame)) continue;
    if (!entry.frame && isNumber(entry.digits)) {
      listing.tooLarge = entry.path;
    } else if (!entry.frame) {
      if (listing.substeps++ > 0) continue;
      listing.exampleOfSubsteps = entry.path;
      listing.patternOfSubsteps = before_ + pattern_ + fractionIn(entry.digits) + after_;
    } else if (entry.digits == blenderDigitsOf(*entry.frame) &&
               frames.insert(*entry.frame).second) {
      continue;  // Blender's form, where the other form is absent
    } else {
      if (others.empty()) listing.exampleOfOthers = entry.path;
      others.insert(*entry.frame);
      fewestDigits = std::min(fewestDigits, entry.digits.size());
    }
  }
  listing.frames.assign(frames.begin(), frames.end());
  listing.others.assign(others.begin(), others.end());
  if (!others.empty()) listing.patternOfAll = patternOfAll(all, fewestDigits);
  return listing;
}

std::string FramePattern::patternOfAll(const std::vector<Entry>& all, std::size_t digits) const {
  FramePattern other = *this;
  other.digits_ = digits;
  std::set<FrameNumber> numbers;
  for (const Entry& entry : all) {
    if (!entry.frame) continue;
    const bool isIts = entry.digits == other.digitsOf(*entry.frame) ||
                       entry.digits == other.blenderDigitsOf(*entry.frame);
    if (!isIts || !numbers.insert(*entry.frame).second) return {};
  }
  return before_ + std::string(digits, '@') + after_;
}

}  // namespace esvr::cli
