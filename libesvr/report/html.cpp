#include "report/html.h"

#include <algorithm>
#include <array>

#include "report/escape.h"

namespace esvr::report {
namespace {

/// Elements within a line: white space beside them would be seen.
constexpr std::array<std::string_view, 3> kInline{"button", "output", "span"};

std::string startTag(const char* name, const Attributes& attributes) {
  std::string tag = std::string("<") + name;
  for (const auto& attribute : attributes)
    tag += std::string(" ") + attribute.name + "=\"" + escaped(attribute.value) + '"';
  return tag + '>';
}

}  // namespace

Html& Html::operator+=(const Html& after) {
  markup += after.markup;
  return *this;
}

Html htmlText(std::string_view text) { return {escaped(text)}; }

Html element(const char* name, const Attributes& attributes, const Html& content) {
  const bool isInline = std::find(kInline.begin(), kInline.end(), name) != kInline.end();
  return {startTag(name, attributes) + content.markup + "</" + name + '>' + (isInline ? "" : "\n")};
}

Html element(const char* name, const Attributes& attributes, std::string_view text) {
  return element(name, attributes, htmlText(text));
}

Html element(const char* name, std::string_view text) { return element(name, {}, text); }

Html voidElement(const char* name, const Attributes& attributes) {
  return {startTag(name, attributes)};
}

}  // namespace esvr::report
