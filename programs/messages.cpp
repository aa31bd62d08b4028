// Text for people: messages, tables and what is shown of texts of unknown origin.
#include "programs/messages.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <ostream>
#include <stdexcept>
#include <utility>

#include "esvr/grid.h"

namespace esvr::cli {

std::string printable(const std::string& text) { return shownText(text, LineEnds::kReplace); }

std::string printableMessage(const std::string& text) { return shownText(text, LineEnds::kKeep); }

namespace {

/// Writes the line at once, so that the lines of several threads do not mix.
void printLine(const std::string& line) { std::cerr << line + '\n'; }

}  // namespace

void Log::info(const std::string& message) const {
  if (verbosity_ != Verbosity::kQuiet) printLine(printableMessage(message));
}

void Log::detail(const std::string& message) const {
  if (verbosity_ == Verbosity::kVerbose) printLine(printableMessage(message));
}

void Log::error(const std::string& message) const {
  printLine(program_ + ": " + printableMessage(message));
}

void Log::warning(const std::string& message, const std::string& figure) const {
  if (warnings_) return warnings_(message);
  const std::string text = figure.empty() ? message : message + " (" + figure + ')';
  if (verbosity_ != Verbosity::kQuiet) printLine(program_ + ": warning: " + printableMessage(text));
}

namespace {

std::string formatted(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string padded(const std::string& text, std::size_t width, bool flushLeft) {
  const std::string space(width - std::min(width, text.size()), ' ');
  return flushLeft ? text + space : space + text;
}

}  // namespace

void Table::add(std::vector<std::string> row) {
  if (!rows_.empty() && row.size() > rows_.front().size())
    throw std::logic_error("a row of a table has more cells than the table has columns");
  for (auto& cell : row) cell = printable(cell);
  rows_.push_back(std::move(row));
}

void Table::print(std::ostream& out) const {
  constexpr const char* kGap = "  ";
  std::vector<std::size_t> widths(rows_.front().size(), 0);
  for (const auto& row : rows_)
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  for (const auto& row : rows_) {
    for (std::size_t c = 0; c < row.size(); ++c)
      out << (c == 0 ? "" : kGap) << padded(row[c], widths[c], c == 0);
    out << '\n';
  }
}

std::string decibels(double value) {
  return std::isinf(value) ? "exact" : formatted("%.2f", value);
}
std::string shortNumber(double value) { return formatted("%.4g", value); }
std::string seconds(double value) { return formatted("%.1f", value); }

std::string textOf(const Box& box) {
  return box.empty() ? "empty" : toString(box.min) + " to " + toString(box.max);
}

void printMetadata(const std::string& title, const std::vector<MetaItem>& items,
                   std::ostream& out) {
  for (const auto& item : items)
    out << printable(title + ": " + item.name + " (" + item.type + ")") << '\n';
}

std::string shellWord(const std::string& word) {
  const bool plain =
      !word.empty() &&
      word.find_first_not_of(
          "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=,:+%") ==
          std::string::npos;
  if (plain) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace esvr::cli
