// Plan: the tests check which pictures a sheet has, their captions, and what is folded.

#include "report/html_pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "report/base64.h"

namespace esvr::report {
namespace {

using testing::HasSubstr;
using testing::Not;

PictureSheet sheet() {
  return {.caption = "The first view.",
          .reference = {.name = "reference", .png = "REF"},
          .shots = {{.name = "fit & co",
                     .figures = "46 KB",
                     .png = "OURS",
                     .errorPng = "ERRORS",
                     .emphasis = Emphasis::kOurs}}};
}

std::size_t pictures(const std::string& html, const std::string& png) {
  const std::string source = "base64," + base64(png) + "\"";
  std::size_t found = 0;
  for (std::size_t at = html.find(source); at != std::string::npos; at = html.find(source, at + 1))
    ++found;
  return found;
}

TEST(HtmlPictures, showsThePictureItsErrorsAndBothHalves) {
  const std::string html = toHtml(sheet()).markup;
  EXPECT_EQ(pictures(html, "REF"), 2u) << "alone and as a half";
  EXPECT_EQ(pictures(html, "OURS"), 2u);
  EXPECT_EQ(pictures(html, "ERRORS"), 1u);
  EXPECT_THAT(html, HasSubstr("alt=\"errors of fit &amp; co\""));
  EXPECT_THAT(html, HasSubstr("<span>46 KB</span>"));
  EXPECT_THAT(html, HasSubstr("type=\"range\""));
}

TEST(HtmlPictures, hasTheScaleOfErrors) {
  EXPECT_THAT(toHtml(sheet()).markup, HasSubstr(">0.125</text>"));
}

TEST(HtmlPictures, foldsTheOthers) {
  EXPECT_THAT(toHtml(sheet()).markup, Not(HasSubstr("<details>")));
  PictureSheet more = sheet();
  more.others = {{.name = "ZFP", .png = "ZFP", .errorPng = "E"}};
  const std::string html = toHtml(more).markup;
  const std::string folded = html.substr(html.find("<details>"));
  EXPECT_EQ(pictures(folded, "ZFP"), 1u);
  EXPECT_EQ(pictures(folded, "REF"), 0u);
}

}  // namespace
}  // namespace esvr::report
