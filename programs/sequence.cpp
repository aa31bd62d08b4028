// Frames in options: ranges of numbers, and names of files with a place for the number of a frame. Sequences in the options of the programs: which frames are converted, from and to which files, and
// what is said about them.

#include "programs/sequence.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>
#include <span>
#include <system_error>
#include <unordered_set>
#include <utility>

#include "core/atomic_file.h"
#include "esvr/sequence_file.h"
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

// ---- Sequences

namespace {

constexpr const char* kFrames = "frames";
constexpr const char* kMissing = "missing";
constexpr const char* kOnError = "on-error";

void refuseSequenceOptions(const Arguments& arguments) {
  for (const char* option : {kFrames, kMissing, kOnError})
    if (arguments.has(option))
      throw UsageError("--" + std::string(option) + " needs a sequence as input: '" +
                       arguments.get<std::string>("input") +
                       "' is a file of one frame, without a pattern such as #### or %04d for the "
                       "number of a frame");
}

/// A name like that of a path, with a pattern before its extension.
std::string withPattern(const fs::path& path, const std::string& pattern) {
  const std::string name = path.stem().string() + "." + pattern + path.extension().string();
  return (path.parent_path() / name).string();
}

FramePattern outputPattern(const Arguments& arguments, const FramePattern& input,
                           WholeFiles allowed) {
  constexpr const char* kUsualPattern = "####";
  const auto& text = arguments.get<std::string>("output");
  const auto output = FramePattern::in(text);
  if (output) return *output;
  const auto range = arguments.find<std::string>(kFrames);
  const bool isOne = allowed.outputOfOneFrame && range && parseFrames(kFrames, *range).size() == 1;
  if (allowed.output || isOne) return FramePattern::whole(text);
  const bool isInFolder = FramePattern::ofInput(text).has_value();
  throw UsageError("'" + text + "' has no pattern for the number of a frame" +
                   (isInFolder ? " in the name of the file" : "") + ", but '" + input.text() +
                   (input.isWhole() ? "' holds a sequence" : "' has one") +
                   "; each frame needs a file of its own, for example '" +
                   withPattern(text, input.isWhole() ? kUsualPattern : input.pattern()) + "'" +
                   (allowed.outputOfOneFrame ? ", or --frames names a single frame" : ""));
}

MissingFrame missingOf(const Arguments& arguments) {
  return choose<MissingFrame>(kMissing, arguments.find<std::string>(kMissing).value_or("error"),
                              {{"error", MissingFrame::kError},
                               {"hold", MissingFrame::kHold},
                               {"skip", MissingFrame::kSkip}});
}

OnFrameError onErrorOf(const Arguments& arguments) {
  return choose<OnFrameError>(
      kOnError, arguments.find<std::string>(kOnError).value_or("continue"),
      {{"continue", OnFrameError::kContinue}, {"stop", OnFrameError::kStop}});
}

bool hasInput(const Sequence& sequence, FrameNumber number) {
  if (sequence.stored) return std::ranges::binary_search(*sequence.stored, number);
  return isThere(sequence.input.toRead(number));
}

std::vector<FrameNumber> missingNumbers(const std::vector<Frame>& frames) {
  std::vector<FrameNumber> numbers;
  for (const Frame& frame : frames)
    if (frame.missing) numbers.push_back(frame.number);
  std::ranges::sort(numbers);
  return numbers;
}

/// Sets what each missing frame holds: the frame with the next lower number that exists.
void holdFrames(const Sequence& sequence, std::vector<Frame>& frames) {
  std::map<FrameNumber, std::size_t> existing;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (!frames[i].missing) existing[frames[i].number] = i;
  for (Frame& frame : frames) {
    if (!frame.missing) continue;
    const auto after = existing.lower_bound(frame.number);
    if (after == existing.begin())
      throw BadInput(sequence.input.text() + ": frame " + std::to_string(frame.number) +
                     " is missing, and no frame before it can be held");
    frame.holds = std::prev(after)->second;
  }
}

/// \param hint  what looks like frames and is none; may be empty
void treatMissing(const Sequence& sequence, std::vector<Frame>& frames, const std::string& hint) {
  const auto missing = missingNumbers(frames);
  if (missing.empty()) return;
  const std::string text = sequence.input.text() + ": " +
                           (missing.size() == 1 ? "frame " : "frames ") + textOfFrames(missing) +
                           (missing.size() == 1 ? " is missing" : " are missing");
  const std::string others = hint.empty() ? "" : "; " + hint;
  if (missing.size() == frames.size())
    throw BadInput(text + ", and no other frame is wanted" + others);
  if (sequence.missing == MissingFrame::kError)
    throw BadInput(text +
                   " (--missing skip leaves them out, --missing hold repeats the frame before)" +
                   others);
  if (sequence.missing == MissingFrame::kHold) holdFrames(sequence, frames);
}

void refuseExisting(const std::vector<Frame>& frames) {
  std::vector<FrameNumber> existing;
  const Frame* first = nullptr;
  for (const Frame& frame : frames) {
    if (!isThere(frame.output)) continue;
    if (!first) first = &frame;
    existing.push_back(frame.number);
  }
  if (!first) return;
  std::ranges::sort(existing);
  std::string text = "cannot write " + first->output.string() + ": it exists already";
  if (existing.size() > 1)
    text += ", as do the files of other frames (" + textOfFrames(existing) + ")";
  throw RuntimeFailure(text + "; --force replaces files");
}

void requireSeparateFrames(const Sequence& sequence, const std::vector<Frame>& frames,
                           const FrameOutputRules& rules) {
  std::vector<fs::path> inputs = rules.moreInputs, outputs = rules.moreOutputs;
  for (const Frame& frame : frames) {
    if (!frame.missing) inputs.push_back(frame.input);
    if ((!frame.missing || frame.holds) && !sequence.output.isWhole())
      outputs.push_back(frame.output);
  }
  if (sequence.output.isWhole()) outputs.emplace_back(sequence.output.text());
  requireSeparate(inputs, outputs);
}

}  // namespace

std::vector<fs::path> filesOfInput(const std::string& input) {
  const auto pattern = FramePattern::ofInput(input);
  if (!pattern) return {input};
  std::vector<fs::path> files;
  for (const FrameNumber frame : pattern->onDisk().frames) files.push_back(pattern->toRead(frame));
  return files;
}

void addSequenceOptions(po::options_description& options) {
  // clang-format off
  options.add_options()
    (kFrames, po::value<std::string>()->value_name("RANGE"),
     "of a sequence: the frames to convert, for example 1-100, 1-100x2, 1-10,20-30 or -5--1 "
     "(default: all that there are)")
    (kMissing, po::value<std::string>()->value_name("W"),
     "frames of --frames that are missing: error (nothing is converted; the default), hold "
     "(repeat the output of the frame before) or skip")
    (kOnError, po::value<std::string>()->value_name("W"),
     "continue (the default) or stop after a frame that could not be converted");
  // clang-format on
}

std::optional<std::vector<FrameNumber>> framesInFile(const fs::path& path) {
  if (path.extension() != ".esvr" || !isThere(path) || !holdsSequence(path)) return std::nullopt;
  std::vector<FrameNumber> numbers;
  const SequenceReader reader(path);
  for (const SequenceFrame& frame : reader.frames()) numbers.push_back(frame.number);
  return numbers;
}

std::optional<Sequence> readSequence(const Arguments& arguments, WholeFiles allowed) {
  const auto& text = arguments.get<std::string>("input");
  auto stored = allowed.input ? framesInFile(text) : std::nullopt;
  auto input = FramePattern::ofInput(text);
  if (stored) input = FramePattern::whole(text);
  if (!input) {
    refuseSequenceOptions(arguments);
    return std::nullopt;
  }
  Sequence sequence{.input = *input, .output = outputPattern(arguments, *input, allowed)};
  sequence.stored = std::move(stored);
  if (const auto range = arguments.find<std::string>(kFrames))
    sequence.frames = parseFrames(kFrames, *range);
  sequence.missing = missingOf(arguments);
  sequence.onError = onErrorOf(arguments);
  return sequence;
}

FrameListing framesOnDisk(const FramePattern& input) {
  FrameListing listing = input.onDisk();
  if (!listing.frames.empty()) return listing;
  const std::string hint = listing.hint();
  throw BadInput("no file matches " + input.text() + (hint.empty() ? "" : "; " + hint));
}

std::vector<Frame> planFrames(const Sequence& sequence, const Log& log) {
  FrameListing listing;
  if (!sequence.stored)
    listing = sequence.frames ? sequence.input.onDisk() : framesOnDisk(sequence.input);
  const auto& wanted = sequence.frames   ? *sequence.frames
                       : sequence.stored ? *sequence.stored
                                         : listing.frames;
  std::vector<Frame> frames;
  for (const FrameNumber number : wanted)
    frames.push_back({number,
                      sequence.input.toRead(number),
                      sequence.output.at(number),
                      !hasInput(sequence, number),
                      {}});
  if (sequence.output.isWhole()) std::ranges::sort(frames, {}, &Frame::number);
  const std::string hint = listing.hint(sequence.frames ? &wanted : nullptr);
  treatMissing(sequence, frames, hint);
  if (!hint.empty()) log.warning(sequence.input.text() + ": " + hint);
  return frames;
}

std::multimap<std::size_t, std::size_t> holdersOf(const std::vector<Frame>& frames) {
  std::multimap<std::size_t, std::size_t> holders;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (frames[i].holds) holders.emplace(*frames[i].holds, i);
  return holders;
}

void checkFrameOutputs(const Sequence& sequence, const std::vector<Frame>& frames,
                       const FrameOutputRules& rules) {
  requireSeparateFrames(sequence, frames, rules);
  if (sequence.output.isWhole())
    return checkOutput(sequence.output.text(), rules.extensions, rules.mayExist);
  if (!rules.mayExist) refuseExisting(frames);
  requireExtension(frames.front().output, rules.extensions);
  if (!isThere(sequence.output.folder()))
    throw RuntimeFailure("cannot write " + sequence.output.text() + ": there is no folder " +
                         sequence.output.folder().string());
  checkOutput(frames.front().output, rules.extensions, true);  // the folder is writable
}

// Messages.

std::string textOf(const Frame& frame) { return "frame " + std::to_string(frame.number); }

std::string sentenceOn(const std::vector<FrameNumber>& numbers, std::size_t all,
                       const std::string& what) {
  return std::to_string(numbers.size()) + " of " + counted(all, "frame") + " " + what + ": " +
         textOfFrames(numbers);
}

Error failureToHold(const Frame& held, const Error& failure) {
  return {failure.kind(), textOf(held) + ", which it holds, failed"};
}

void FrameWarnings::add(FrameNumber frame, const std::string& text) {
  const std::lock_guard lock(mutex_);
  frames_[text].insert(frame);
}

Log FrameWarnings::logOf(const Frame& frame, const std::string& program, Verbosity verbosity) {
  return {program + ": " + textOf(frame), verbosity,
          [this, number = frame.number](const std::string& text) { add(number, text); }};
}

void FrameWarnings::tell(const Log& log) const {
  for (const auto& [text, frames] : frames_)
    log.warning((frames.size() == 1 ? "frame " : "frames ") +
                textOfFrames(std::vector(frames.begin(), frames.end())) + ": " + text);
}

void copyOutput(const fs::path& from, const fs::path& to, bool overwrite) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  std::ifstream input(from, std::ios::binary);
  AtomicFile output(to, overwrite);
  std::vector<char> block(kBlock);
  while (input.read(block.data(), std::streamsize(block.size())) || input.gcount() > 0)
    output.write(std::as_bytes(std::span(block.data(), std::size_t(input.gcount()))));
  if (!input.eof()) throw RuntimeFailure("cannot read " + from.string());
  output.commit();
}

}  // namespace esvr::cli
