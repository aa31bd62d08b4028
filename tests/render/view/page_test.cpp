// Plan: a file is put into a small page and into the bundle, and taken out again by hand.

#include "render/view/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

namespace esvr::view {
namespace {

using testing::HasSubstr;

constexpr const char* kPage =
    "<p>before</p>\n<script id=\"esvr-file\" type=\"application/octet-stream;base64\" "
    "data-name=\"\"></script>\n<p>after</p>";

TEST(ExportedPage, HasTheFileAndItsNameInTheirPlaces) {
  EXPECT_EQ(exportedPage(kPage, "a.esvr", std::string("\0\1\2\3", 4)),
            "<p>before</p>\n<script id=\"esvr-file\" type=\"application/octet-stream;base64\" "
            "data-name=\"a.esvr\">AAECAw==</script>\n<p>after</p>");
}

TEST(ExportedPage, HasNamesThatAreNoMarkup) {
  EXPECT_THAT(exportedPage(kPage, "\"></script><b>&.esvr", "x"),
              HasSubstr("data-name=\"&quot;&gt;&lt;/script&gt;&lt;b&gt;&amp;.esvr\">eA==<"));
}

TEST(ExportedPage, OfTheBundleHasEverythingElseUnchanged) {
  const std::string_view bundle = exportPageBundle();
  const std::string page = exportedPage(bundle, "a", "xyz");
  EXPECT_EQ(page.size(), bundle.size() + 1 + 4);
  const std::size_t place = page.find("eHl6</script>");
  ASSERT_NE(place, std::string::npos);
  EXPECT_EQ(page.substr(place + 4), bundle.substr(place - 1));
}

TEST(ExportedPage, NeedsAPlace) {
  EXPECT_THROW((void)exportedPage("<p></p>", "a", "x"), std::logic_error);
}

}  // namespace
}  // namespace esvr::view
