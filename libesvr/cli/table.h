#pragma once
/// Tables in the output of programs.

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace esvr::cli {

/// Rows of equal length. The first column is text, aligned left; the others are numbers, aligned
/// right.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  void add(std::vector<std::string> row);
  void print(std::ostream& out) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// A PSNR with two decimals, for example "51.54"; "exact" if it is infinite.
[[nodiscard]] std::string decibels(double value);
/// A number with four significant digits.
[[nodiscard]] std::string shortNumber(double value);
/// A time with one decimal, for example "12.3", so that a column is aligned.
[[nodiscard]] std::string seconds(double value);

}  // namespace esvr::cli
