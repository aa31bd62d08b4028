// Plan: the tests check the frame of a page: its headline, that texts are escaped, and that it names
// nothing outside itself.

#include "report/html_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "report/page_files.h"

namespace esvr::report {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

HtmlPage framedPage() {
  return {.title = "<a.vdb>",
          .finding = "ESVR has 52.3 dB & more.",
          .paragraphs = {"One.", ""},
          .sections = {section("kind", "Part", element("p", "content"))},
          .commands = {"esvr-compare table 'a<b'", "esvr 0.1.0"}};
}

TEST(HtmlPage, hasTheFindingAsItsHeadline) {
  const std::string html = toHtml(framedPage());
  EXPECT_THAT(html, StartsWith("<!DOCTYPE html>\n<html lang=\"en\">"));
  EXPECT_THAT(html, HasSubstr("<title>&lt;a.vdb&gt;</title>"));
  EXPECT_THAT(html, HasSubstr("<h1>ESVR has 52.3\u00a0dB &amp; more.</h1>"));
  EXPECT_THAT(html, HasSubstr("<h2>Part</h2>\n<p>content</p>"));
  EXPECT_THAT(html, HasSubstr("a&lt;b"));
  EXPECT_THAT(html, Not(HasSubstr("<p></p>"))) << "empty paragraphs are left out";
}

TEST(HtmlPage, hasItsTitleAsHeadlineWithoutAFinding) {
  HtmlPage plain = framedPage();
  plain.finding.clear();
  EXPECT_THAT(toHtml(plain), HasSubstr("<h1>&lt;a.vdb&gt;</h1>"));
}

TEST(HtmlPage, hasColorsForLightAndDark) {
  EXPECT_THAT(toHtml(framedPage()), HasSubstr(std::string(pageStyle())));
  EXPECT_THAT(std::string(pageStyle()), HasSubstr("prefers-color-scheme:dark"));
}

TEST(HtmlPage, namesNothingOutsideItself) {
  const std::string html = toHtml(framedPage());
  for (const char* reference : {"http:", "https:", "@import", "<link", "src=", "url(", "fetch("})
    EXPECT_THAT(html, Not(HasSubstr(reference)));
}

TEST(PageFiles, cannotEndTheirElements) {
  EXPECT_THAT(std::string(pageStyle()), Not(HasSubstr("</style")));
  EXPECT_THAT(std::string(pageScript()), Not(HasSubstr("</script")));
}

}  // namespace
}  // namespace esvr::report
