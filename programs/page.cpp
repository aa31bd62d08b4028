// Pages in HTML, and the encodings of what they hold.
#include "programs/page.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "esvr/grid.h"

namespace esvr::report {

std::string base64(std::string_view bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  constexpr std::size_t kGroup = 3, kDigitsPerGroup = 4, kDigitBits = 6;
  std::string text;
  for (std::size_t at = 0; at < bytes.size(); at += kGroup) {
    const std::size_t have = std::min(kGroup, bytes.size() - at);
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < kGroup; ++i)
      bits = bits << 8 | (i < have ? std::uint8_t(bytes[at + i]) : 0u);
    for (std::size_t i = 0; i < kDigitsPerGroup; ++i) {
      const std::uint32_t digit = bits >> (kDigitBits * (kDigitsPerGroup - 1 - i)) & 63u;
      text += i <= have ? kDigits[digit] : '=';
    }
  }
  return text;
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : shownText(text, LineEnds::kKeep)) switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  return result;
}

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

namespace {

Html verbatim(const char* element, std::string_view content) {
  return {std::string("<") + element + ">" + std::string(content) + "</" + element + ">\n"};
}

Html headOf(const HtmlPage& page) {
  Html head = voidElement("meta", {{"charset", "utf-8"}});
  head += voidElement("meta",
                      {{"name", "viewport"}, {"content", "width=device-width, initial-scale=1"}});
  head += voidElement("meta", {{"name", "color-scheme"}, {"content", "light dark"}});
  head += element("title", page.title);
  head += verbatim("style", pageStyle());
  // Before anything is drawn, so that what only the script can unfold does not flash.
  head += verbatim("script", "document.documentElement.classList.add('scripted')");
  return element("head", {}, head);
}

/// Keeps a number and the word behind it, such as its unit, in one line.
std::string withWholeFigures(const std::string& text) {
  constexpr const char* kNoBreakSpace = "\u00a0";
  std::string result;
  for (const char c : text) {
    const bool behindDigit = !result.empty() && result.back() >= '0' && result.back() <= '9';
    result += c == ' ' && behindDigit ? kNoBreakSpace : std::string(1, c);
  }
  return result;
}

Html headerOf(const HtmlPage& page) {
  Html header;
  if (!page.finding.empty()) header += element("p", {{"class", "title"}}, page.title);
  header += element("h1", page.finding.empty() ? page.title : withWholeFigures(page.finding));
  for (const auto& paragraph : page.paragraphs)
    if (!paragraph.empty()) header += element("p", paragraph);
  return element("header", {}, header);
}

Html footerOf(const HtmlPage& page) {
  std::string lines;
  for (const auto& command : page.commands) lines += command + '\n';
  return section("commands", "Commands and versions", element("pre", lines));
}

}  // namespace

Html section(const char* kind, const std::string& heading, const Html& content) {
  Html body = element("h2", heading);
  body += content;
  return element("section", {{"class", kind}}, body);
}

std::string toHtml(const HtmlPage& page) {
  Html main = headerOf(page);
  for (const auto& part : page.sections) main += part;
  main += footerOf(page);
  Html body = element("main", {}, main);
  body += verbatim("script", pageScript());
  Html all = headOf(page);
  all += element("body", {}, body);
  return "<!DOCTYPE html>\n" + element("html", {{"lang", "en"}}, all).markup;
}

}  // namespace esvr::report
