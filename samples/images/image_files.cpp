#include "images/image_files.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <system_error>

#include "cli/sequence.h"
#include "esvr/error.h"
#include "images/image_format.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;

bool isDigit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

/// The digits from a place on without zeros before them.
std::string digitsAt(const std::string& text, std::size_t& at) {
  while (at < text.size() && text[at] == '0') ++at;
  const std::size_t begin = at;
  while (at < text.size() && isDigit(text[at])) ++at;
  return text.substr(begin, at - begin);
}

bool comesBefore(const fs::path& a, const fs::path& b) { return isBefore(a.string(), b.string()); }

std::vector<fs::path> filesOfFolder(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (hasTiffName(at->path())) paths.push_back(at->path());
  if (error) throw BadInput("cannot read " + folder.string() + ": " + error.message());
  if (paths.empty()) throw BadInput(folder.string() + " has no TIFF file");
  std::ranges::sort(paths, comesBefore);
  return paths;
}

/// Refuses a stack with a gap: its slices would be in wrong places.
void requireEvenSteps(const cli::FramePattern& pattern,
                      const std::vector<cli::FrameNumber>& numbers) {
  if (numbers.size() < 2) return;
  cli::FrameNumber step = numbers[1] - numbers[0];
  for (std::size_t i = 1; i < numbers.size(); ++i)
    step = std::min(step, numbers[i] - numbers[i - 1]);
  for (std::size_t i = 1; i < numbers.size(); ++i)
    if (numbers[i] - numbers[i - 1] != step)
      throw BadInput(pattern.text() + ": slice " + std::to_string(numbers[i - 1] + step) +
                     " is missing");
}

ImageFiles filesOfPattern(const cli::FramePattern& pattern) {
  const cli::FrameListing listing = cli::framesOnDisk(pattern);
  requireEvenSteps(pattern, listing.frames);
  ImageFiles files{.paths = {}, .hint = listing.hint()};
  for (const cli::FrameNumber number : listing.frames)
    files.paths.push_back(pattern.toRead(number));
  return files;
}

}  // namespace

bool isBefore(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (isDigit(a[i]) && isDigit(b[j])) {
      const std::string x = digitsAt(a, i), y = digitsAt(b, j);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
    }
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;  // they differ in zeros before numbers
}

ImageFiles imageFiles(const std::vector<std::string>& names) {
  if (names.size() > 1) {
    const std::vector<fs::path> paths(names.begin(), names.end());
    return {paths, !std::ranges::is_sorted(paths, comesBefore)};
  }
  // A path that cannot be examined is refused later, when it is opened.
  std::error_code ignored;
  const fs::path path = names.front();
  if (fs::is_directory(path, ignored)) return {filesOfFolder(path)};
  const auto pattern = cli::FramePattern::ofInput(names.front());
  return pattern ? filesOfPattern(*pattern) : ImageFiles{{path}};
}

}  // namespace esvr::samples
