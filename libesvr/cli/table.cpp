#include "cli/table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>
#include <utility>

#include "cli/printable.h"

namespace esvr::cli {
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

}  // namespace esvr::cli
