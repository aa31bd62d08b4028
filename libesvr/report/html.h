#pragma once
/// Pieces of HTML in which all texts and values of attributes are escaped.

#include <string>
#include <string_view>
#include <vector>

namespace esvr::report {

struct Html {
  std::string markup{};

  Html& operator+=(const Html& after);
};

struct Attribute {
  const char* name;
  std::string value{};
};
using Attributes = std::vector<Attribute>;

[[nodiscard]] Html htmlText(std::string_view text);

/// An element with its content. Elements of blocks end with a line feed.
[[nodiscard]] Html element(const char* name, const Attributes& attributes, const Html& content);
[[nodiscard]] Html element(const char* name, const Attributes& attributes, std::string_view text);
[[nodiscard]] Html element(const char* name, std::string_view text);

/// An element that has no content and no end: img, input.
[[nodiscard]] Html voidElement(const char* name, const Attributes& attributes);

}  // namespace esvr::report
