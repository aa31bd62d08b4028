// Plan: the tests check that texts and values of attributes cannot become markup.

#include "report/html.h"

#include <gtest/gtest.h>

namespace esvr::report {
namespace {

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

}  // namespace
}  // namespace esvr::report
