// Plan: base64 agrees with the test vectors of RFC 4648. Texts and values of attributes cannot
// become markup, whatever control characters and invalid UTF-8 they have. A page has its headline
// and names nothing outside itself.

#include "programs/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace esvr::report {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(Base64, agreesWithTheStandardsVectors) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

TEST(Base64, takesAnyByte) { EXPECT_EQ(base64(std::string("\xff\xfe\x00", 3)), "//4A"); }

TEST(Escaped, makesMarkupText) {
  EXPECT_EQ(escaped("<a b=\"c\">&"), "&lt;a b=&quot;c&quot;&gt;&amp;");
}

TEST(Escaped, keepsLinesAndDropsOtherControls) {
  EXPECT_EQ(escaped("a\nb\x1b[1m\x7f"), "a\nb?[1m?");
}

TEST(Escaped, keepsUtf8) {
  EXPECT_EQ(escaped("\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80"),
            "\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80");
}

TEST(Escaped, replacesWhatIsNoUtf8) {
  EXPECT_EQ(escaped("\xff"), "?");
  EXPECT_EQ(escaped("a\xc3"), "a?") << "cut short";
  EXPECT_EQ(escaped("\xc0\xbc"), "??") << "an overlong '<'";
  EXPECT_EQ(escaped("\xe0\x80\xbc"), "???");
  EXPECT_EQ(escaped("\xed\xa0\x80"), "???") << "a surrogate";
  EXPECT_EQ(escaped("\xf4\x90\x80\x80"), "????") << "beyond Unicode";
}

TEST(Html, escapesTextsAndValues) {
  EXPECT_EQ(element("p", "<b> & \"c\"").markup, "<p>&lt;b&gt; &amp; &quot;c&quot;</p>\n");
  EXPECT_EQ(element("span", {{"title", "\"><script>"}}, "x").markup,
            "<span title=\"&quot;&gt;&lt;script&gt;\">x</span>");
  EXPECT_EQ(voidElement("img", {{"alt", "a\"b"}}).markup, "<img alt=\"a&quot;b\">");
}

TEST(Html, keepsTheMarkupOfItsParts) {
  Html parts = htmlText("a<");
  parts += element("span", "b");
  EXPECT_EQ(element("div", {}, parts).markup, "<div>a&lt;<span>b</span></div>\n");
}

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
