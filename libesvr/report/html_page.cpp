#include "report/html_page.h"

#include "report/page_files.h"

namespace esvr::report {
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
