#pragma once
/// A self-contained HTML page, which needs no other file and no network. It can be read without
/// its script, in light and dark colors, on narrow and wide screens.

#include <string>
#include <vector>

#include "report/html.h"

namespace esvr::report {

struct HtmlPage {
  std::string title;                    ///< what the page is about
  std::string finding;                  ///< its headline; if it is empty, the title is
  std::vector<std::string> paragraphs;  ///< empty ones are left out
  std::vector<Html> sections;
  std::vector<std::string> commands;  ///< and versions: a line each
};

/// The page as HTML 5 in UTF-8.
[[nodiscard]] std::string toHtml(const HtmlPage& page);

/// A part of a page under a heading. `kind` is its class in page.css.
[[nodiscard]] Html section(const char* kind, const std::string& heading, const Html& content);

}  // namespace esvr::report
