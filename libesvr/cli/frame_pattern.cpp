#include "cli/frame_pattern.h"

#include <algorithm>
#include <regex>
#include <system_error>
#include <utility>

#include "cli/number.h"
#include "esvr/error.h"

namespace esvr::cli {
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

/// The last pattern of a path.
std::optional<std::smatch> lastPattern(const std::string& path) {
  static const std::regex kPattern(R"(#+|@+|%[0-9]*d|\$F[0-9]*)");
  std::optional<std::smatch> last;
  for (std::sregex_iterator at(path.begin(), path.end(), kPattern), end; at != end; ++at)
    last = *at;
  return last;
}

/// The part of a name between its beginning and its end; nothing if it has others.
std::optional<std::string> between(const std::string& name, const std::string& prefix,
                                   const std::string& suffix) {
  const std::size_t taken = prefix.size() + suffix.size();
  if (name.size() < taken || !name.starts_with(prefix) || !name.ends_with(suffix))
    return std::nullopt;
  return name.substr(prefix.size(), name.size() - taken);
}

}  // namespace

struct FramePattern::Entry {
  FrameNumber frame = 0;
  bool hasDigits = false;  ///< the name has the number of digits that the pattern gives
  fs::path path;           ///< with the name's own digits
};

std::optional<FramePattern> FramePattern::in(const std::string& path) {
  const auto found = lastPattern(path);
  if (!found) return std::nullopt;
  FramePattern made;
  made.text_ = path;
  made.pattern_ = found->str();
  made.before_ = path.substr(0, std::size_t(found->position()));
  made.after_ = found->suffix().str();
  made.digits_ = digitsOfPattern(made.pattern_);
  if (made.digits_ > kMostDigits)
    throw UsageError(path + ": the number of a frame has at most " + std::to_string(kMostDigits) +
                     " digits");
  return made;
}

FramePattern FramePattern::whole(const std::string& path) {
  FramePattern made;
  made.text_ = made.before_ = path;
  return made;
}

std::string FramePattern::digitsOf(FrameNumber frame) const {
  const std::string digits = std::to_string(frame < 0 ? -frame : frame);
  const std::string minus = frame < 0 ? "-" : "";
  const std::size_t taken = minus.size() + digits.size();
  return minus + std::string(digits_ - std::min(digits_, taken), '0') + digits;
}

fs::path FramePattern::at(FrameNumber frame) const {
  return isWhole() ? text_ : before_ + digitsOf(frame) + after_;
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
    const auto frame = digits ? parseWhole(*digits) : std::nullopt;
    if (!frame || !isFrameNumber(*frame)) continue;
    Entry entry{*frame, *digits == digitsOf(*frame), before_ + *digits + after_};
    std::error_code notThere;  // a link may lead to nothing
    if (fs::exists(entry.path, notThere)) found.push_back(std::move(entry));
  }
  return found;
}

std::vector<FrameNumber> FramePattern::onDisk() const {
  std::vector<FrameNumber> frames;
  for (const Entry& entry : entries())
    if (entry.hasDigits) frames.push_back(entry.frame);
  std::ranges::sort(frames);
  return frames;
}

std::optional<fs::path> FramePattern::withOtherDigits() const {
  std::vector<fs::path> paths;
  for (const Entry& entry : entries())
    if (!entry.hasDigits) paths.push_back(entry.path);
  if (paths.empty()) return std::nullopt;
  return *std::ranges::min_element(paths);
}

}  // namespace esvr::cli
