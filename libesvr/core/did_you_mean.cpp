// The known word that a mistyped one is probably meant to be.
#include "esvr/did_you_mean.h"

#include <algorithm>
#include <cctype>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

namespace esvr {
namespace {

/// Longer words are not compared, because the time is the product of two lengths and a file may have
/// thousands of names.
constexpr std::size_t kMostLetters = 100;
/// The first letters of a word that suffice to mean it.
constexpr std::size_t kLeastBegin = 3;

/// The word without what people mix up: capitals, and underscores for hyphens.
std::string folded(std::string_view word) {
  std::string text(word);
  for (char& c : text) c = c == '_' ? '-' : char(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// The number of letters to insert, to leave out, to replace, or to swap with their neighbour (optimal
/// string alignment), by rows of the table of all beginnings of both words.
std::size_t distanceOf(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before, last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool isSwap = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      row[j] =
          std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (isSwap) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = std::exchange(last, row);
  }
  return last.back();
}

/// How far a word is from a known one, twice the distance; nothing if it is too far to be meant. Among equal
/// words, one that begins with the given one is nearer.
std::optional<std::size_t> nearness(const std::string& given, const std::string& known) {
  if (given.empty() || std::max(given.size(), known.size()) > kMostLetters) return std::nullopt;
  const std::size_t distance = distanceOf(given, known);
  const bool isBegin = known.starts_with(given);
  // A third of the letters: of words that short, one letter more would make another word.
  const std::size_t allowed = std::max<std::size_t>(1, given.size() / 3);
  if (distance <= allowed && distance < known.size())
    return 2 * distance - (isBegin && distance > 0 ? 1 : 0);
  return isBegin && given.size() >= kLeastBegin ? std::optional(2 * allowed) : std::nullopt;
}

}  // namespace

std::string didYouMean(std::string_view given, std::span<const std::string> known,
                       std::string_view quote) {
  if (std::ranges::find(known, given) != known.end()) return "";  // something else is wrong
  const std::string wanted = folded(given);
  const std::string* nearest = nullptr;
  std::size_t least = 0;
  for (const std::string& word : known) {
    const auto distance = nearness(wanted, folded(word));
    if (!distance || (nearest && *distance >= least)) continue;
    nearest = &word;
    least = *distance;
  }
  if (!nearest) return "";
  return "; did you mean " + std::string(quote) + *nearest + std::string(quote) + '?';
}

}  // namespace esvr
