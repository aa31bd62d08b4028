// A table of figures as text, Markdown or comma-separated values, and texts of single figures.
#include "programs/data_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "esvr/grid.h"
#include "programs/run_main.h"

namespace esvr::report {

std::string plainText(double value) {
  std::array<char, 400> text;  // fixed notation of any double
  const double rounded = std::strtod(cli::formatted("%.3g", value).c_str(), nullptr);
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), rounded, std::chars_format::fixed);
  return {text.data(), end.ptr};
}

std::string bytesText(double bytes) {
  constexpr std::array kUnits{" B", " KB", " MB", " GB", " TB"};
  constexpr double kNext = 999.5;  // is rounded to 1000
  std::size_t unit = 0;
  for (; bytes >= kNext && unit + 1 < kUnits.size(); ++unit) bytes /= 1000.0;
  return plainText(bytes) + kUnits[unit];
}

namespace {

using cli::formatted;

std::string numberText(Kind kind, double value) {
  switch (kind) {
    case Kind::kBytes:
      return formatted("%.0f", value);
    case Kind::kMegabytes:
      return formatted("%.3g", value / 1e6);
    case Kind::kDecibels:
      return cli::decibels(value);
    case Kind::kError:
      return formatted("%.2g", value);
    case Kind::kShare:
      return formatted("%.4f", value);
    default:
      return formatted("%.3g", value);
  }
}

std::string csvField(const std::string& given) {
  const std::string text = shownText(given, LineEnds::kKeep);
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

template <class FieldOf>
std::string line(std::size_t fields, const char* before, const char* between, const char* after,
                 const FieldOf& fieldOf) {
  std::string text = before;
  for (std::size_t i = 0; i < fields; ++i) text += (i == 0 ? "" : between) + fieldOf(i);
  return text + after + '\n';
}

std::string markdownLine(std::size_t fields, const auto& fieldOf) {
  return line(fields, "| ", " | ", " |", fieldOf);
}

}  // namespace

std::string cellText(const Column& column, const Cell& cell) {
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  if (const auto* value = std::get_if<double>(&cell)) return numberText(column.kind, *value);
  return "-";
}

std::string exactText(const Cell& cell) {
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  const auto* value = std::get_if<double>(&cell);
  if (!value) return {};
  if (std::isinf(*value)) return *value > 0 ? "inf" : "-inf";
  return cli::exactNumber(*value);
}

DataTable withColumns(const DataTable& table, const std::vector<std::string>& keys) {
  DataTable result{table.title, {}, std::vector<Row>(table.rows.size())};
  for (const auto& key : keys) {
    const auto column = std::find_if(table.columns.begin(), table.columns.end(),
                                     [&](const Column& c) { return c.key == key; });
    if (column == table.columns.end()) throw std::logic_error("the table has no column " + key);
    result.columns.push_back(*column);
    const auto at = std::size_t(column - table.columns.begin());
    for (std::size_t r = 0; r < table.rows.size(); ++r) result.rows[r].push_back(table.rows[r][at]);
  }
  return result;
}

std::string markdownText(const std::string& text) {
  constexpr std::string_view kMarkup = "\\`*_[]<>|~&$#";
  std::string escaped;
  for (const char c : shownText(text, LineEnds::kKeep)) {
    if (kMarkup.find(c) != std::string_view::npos) escaped += '\\';
    escaped += c == '\n' ? ' ' : c;
  }
  return escaped;
}

std::string markdownCode(const std::string& text) {
  const std::string shown = shownText(text, LineEnds::kReplace);
  std::size_t longest = 0, run = 0;
  for (const char c : shown) longest = std::max(longest, run = c == '`' ? run + 1 : 0);
  const std::string fence(longest + 1, '`');
  return longest == 0 ? fence + shown + fence : fence + ' ' + shown + ' ' + fence;
}

std::string toCsv(const DataTable& table) {
  const std::size_t n = table.columns.size();
  const auto csvLine = [&](const auto& fieldOf) { return line(n, "", ",", "", fieldOf); };
  std::string text = csvLine([&](std::size_t i) { return csvField(table.columns[i].key); });
  for (const auto& row : table.rows)
    text += csvLine([&](std::size_t i) { return csvField(exactText(row[i])); });
  return text;
}

std::string toMarkdown(const DataTable& table) {
  const std::size_t n = table.columns.size();
  std::string text = table.title.empty() ? "" : "## " + markdownText(table.title) + "\n\n";
  text += markdownLine(n, [&](std::size_t i) { return markdownText(table.columns[i].header); });
  text += line(n, "|", "|", "|", [&](std::size_t i) {
    return std::string(table.columns[i].kind == Kind::kText ? "---" : "--:");
  });
  for (const auto& row : table.rows)
    text += markdownLine(
        n, [&](std::size_t i) { return markdownText(cellText(table.columns[i], row[i])); });
  return text;
}

}  // namespace esvr::report
