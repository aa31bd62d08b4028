#include "esvr2vdb/list_notes.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <optional>
#include <ostream>
#include <string_view>

#include "programs/messages.h"

namespace esvr::esvr2vdb {
namespace {

/// Names of frame rates without capitals and signs: "fps", "FrameRate", "frames_per_second".
constexpr std::array kFrameRates{"fps", "framerate", "framespersecond", "timecodespersecond"};
/// A longer text is cut, because a file may have any.
constexpr std::size_t kMostLetters = 80;

bool isLetter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool isCapital(char c) { return std::isupper(static_cast<unsigned char>(c)) != 0; }
char lowered(char c) { return char(std::tolower(static_cast<unsigned char>(c))); }

/// The words of a name without capitals: "length_unit" and "lengthUnit" are "length" and "unit".
std::vector<std::string> wordsOf(std::string_view name) {
  std::vector<std::string> words{""};
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool begins = i > 0 && isCapital(name[i]) && !isCapital(name[i - 1]);
    if ((begins || !isLetter(name[i])) && !words.back().empty()) words.emplace_back();
    if (isLetter(name[i])) words.back() += lowered(name[i]);
  }
  return words;
}

bool isLookedFor(std::string_view name) {
  const std::vector<std::string> words = wordsOf(name);
  std::string joined;
  for (const std::string& word : words) joined += word;
  return joined == "creator" || std::ranges::count(kFrameRates, joined) > 0 ||
         std::ranges::count(words, "unit") + std::ranges::count(words, "units") > 0;
}

template <class T>
std::optional<std::string> numberIn(const MetaItem& item) {
  T value{};
  if (item.value.size() != sizeof value) return std::nullopt;
  std::memcpy(&value, item.value.data(), sizeof value);
  if constexpr (std::is_integral_v<T>) return std::to_string(value);
  return cli::shortNumber(double(value));
}

/// The value of an item that is a text or a number; nothing for others.
std::optional<std::string> valueOf(const MetaItem& item) {
  if (item.type == "float") return numberIn<float>(item);
  if (item.type == "double") return numberIn<double>(item);
  if (item.type == "int32") return numberIn<std::int32_t>(item);
  if (item.type == "int64") return numberIn<std::int64_t>(item);
  if (item.type != "string" || item.value.empty()) return std::nullopt;
  const std::string_view text(reinterpret_cast<const char*>(item.value.data()), item.value.size());
  const bool isLong = text.size() > kMostLetters;
  return std::string(text.substr(0, kMostLetters)) + (isLong ? "..." : "");
}

}  // namespace

std::string notesOf(std::span<const MetaItem> metadata) {
  std::string notes;
  for (const MetaItem& item : metadata)
    if (const auto value = valueOf(item); value && isLookedFor(item.name))
      notes += (notes.empty() ? "" : ", ") + item.name + ' ' + *value;
  return notes;
}

void GridNotes::add(const std::string& grid, std::span<const MetaItem> metadata) {
  const std::string text = notesOf(metadata);
  if (text.empty()) return;
  std::string& names = grids_[text];
  if (names.empty()) texts_.push_back(text);
  names += (names.empty() ? "" : ", ") + grid;
}

void GridNotes::print(std::ostream& out) const {
  for (const std::string& text : texts_)
    out << cli::printable(grids_.at(text) + ": " + text) << '\n';
}

void printFileNotes(std::span<const MetaItem> metadata, std::ostream& out) {
  if (const std::string notes = notesOf(metadata); !notes.empty())
    out << cli::printable(notes) << '\n';
}

}  // namespace esvr::esvr2vdb
