#pragma once
/// Tables for people: columns aligned, numbers as short as they may be.

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace esvr::cli {

/// Rows of one length. The first column is text and flush left, the others numbers and flush right.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  void add(std::vector<std::string> row);
  void print(std::ostream& out) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// "51.54"; "exact" for an infinite PSNR.
[[nodiscard]] std::string decibels(double value);
/// Four significant digits, whatever the scale.
[[nodiscard]] std::string shortNumber(double value);
/// "12.3": a decimal, so that a table's column lines up.
[[nodiscard]] std::string seconds(double value);

}  // namespace esvr::cli
