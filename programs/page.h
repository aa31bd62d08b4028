#pragma once
/// Pages in HTML. They are self-contained: a page needs no other file and no network. It can be read
/// without its script, in light and dark colors, on narrow and wide screens.

#include <string>
#include <string_view>
#include <vector>

namespace esvr::report {

/// Base64 (RFC 4648), for pictures within a page.
[[nodiscard]] std::string base64(std::string_view bytes);

/// Text of unknown origin for HTML and XML: markup characters become entities, and it is replaced what shownText() (esvr/grid.h)
/// replaces, but for line feeds.
[[nodiscard]] std::string escaped(std::string_view text);

// Pieces of HTML in which all texts and values of attributes are escaped.

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

// Whole pages.

/// What a page says.
struct HtmlPage {
  std::string title{};                    ///< what the page is about
  std::string finding{};                  ///< its headline; if it is empty, the title is
  std::vector<std::string> paragraphs{};  ///< empty ones are left out
  std::vector<Html> sections{};
  std::vector<std::string> commands{};  ///< and versions: a line each
};

/// The page as HTML 5 in UTF-8.
[[nodiscard]] std::string toHtml(const HtmlPage& page);

/// A part of a page under a heading. `kind` is its class in page.css.
[[nodiscard]] Html section(const char* kind, const std::string& heading, const Html& content);

// The style and the script of pages, which render/page/build.mjs bundles.

[[nodiscard]] std::string_view pageStyle();
[[nodiscard]] std::string_view pageScript();

}  // namespace esvr::report
