// Sequences in the options of the programs: which frames are converted, from and to which files, and
// what is said about them.
#include "programs/sequence.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <span>
#include <system_error>
#include <vector>

#include "core/atomic_file.h"
#include "esvr/error.h"
#include "esvr/sequence_file.h"
#include "programs/files.h"
#include "programs/option_values.h"

namespace esvr::cli {
namespace {

namespace fs = std::filesystem;

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
  if (allowed.output) return FramePattern::whole(text);
  const bool isInFolder = FramePattern::ofInput(text).has_value();
  throw UsageError("'" + text + "' has no pattern for the number of a frame" +
                   (isInFolder ? " in the name of the file" : "") + ", but '" + input.text() +
                   (input.isWhole() ? "' holds a sequence" : "' has one") +
                   "; each frame needs a file of its own, for example '" +
                   withPattern(text, input.isWhole() ? kUsualPattern : input.pattern()) + "'");
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
