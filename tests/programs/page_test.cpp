// Plan: figures are rounded to three digits without an exponent, and change from one unit to the next. Cells are formatted
// for readers and for programs, and tables in each form.
//
// A small table is checked for what readers, screen readers and scripts need: a caption, the scopes of headers, groups,
// folded figures, rows that stand out, and numbers with all digits. The JSON from which the script of a page draws a chart
// (browser_test.cpp) has every point that can be shown, and no text of it ends its element. Larger errors have brighter
// colors, and the scale has the colors of the map. A sheet has its pictures with their captions, and folds the others.
//
// Base64 agrees with the test vectors of RFC 4648. Texts and values of attributes cannot become markup, whatever control
// characters and invalid UTF-8 they have. A page has its headline and names nothing outside itself.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <limits>

#include "programs/page_figures.h"

namespace esvr::report {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

// Data as tables.

TEST(PlainText, hasThreeDigitsAndNoExponent) {
  EXPECT_EQ(plainText(0.000012345), "0.0000123");
  EXPECT_EQ(plainText(258432.0), "258000");
  EXPECT_EQ(plainText(0.1), "0.1");
  EXPECT_EQ(plainText(0.0), "0");
  EXPECT_EQ(plainText(-2.5), "-2.5");
}

TEST(BytesText, takesTheUnitThatFits) {
  EXPECT_EQ(bytesText(800), "800 B");
  EXPECT_EQ(bytesText(45059), "45.1 KB");
  EXPECT_EQ(bytesText(999'499), "999 KB");
  EXPECT_EQ(bytesText(999'500), "1 MB") << "is rounded to the next unit";
  EXPECT_EQ(bytesText(2.6e9), "2.6 GB");
  EXPECT_EQ(bytesText(5e15), "5000 TB") << "the last unit";
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

DataTable table() {
  return {"Sizes",
          {{"name", "row", Kind::kText},
           {"bytes", "bytes", Kind::kBytes},
           {"psnr", "PSNR", Kind::kDecibels}},
          {{std::string("a, \"b\""), 48214.0, 44.712}, {std::string("c|d"), Cell(), kInfinity}}};
}

TEST(CellText, isShortForPeople) {
  EXPECT_EQ(cellText({"", "", Kind::kBytes}, 1234567.0), "1234567");
  EXPECT_EQ(cellText({"", "", Kind::kMegabytes}, 1234567.0), "1.23");
  EXPECT_EQ(cellText({"", "", Kind::kDecibels}, 44.7123), "44.71");
  EXPECT_EQ(cellText({"", "", Kind::kDecibels}, kInfinity), "exact");
  EXPECT_EQ(cellText({"", "", Kind::kShare}, 0.99876), "0.9988");
  EXPECT_EQ(cellText({"", "", Kind::kNumber}, 0.00123456), "0.00123");
  EXPECT_EQ(cellText({"", "", Kind::kNumber}, Cell()), "-");
  EXPECT_EQ(cellText({"", "", Kind::kText}, std::string("x")), "x");
}

TEST(ExactText, losesNothing) {
  EXPECT_EQ(exactText(1.0 / 3.0), "0.3333333333333333");
  EXPECT_EQ(exactText(kInfinity), "inf");
  EXPECT_EQ(exactText(Cell()), "");
}

TEST(Csv, quotesWhatItMust) {
  EXPECT_EQ(toCsv(table()), "name,bytes,psnr\n\"a, \"\"b\"\"\",48214,44.712\nc|d,,inf\n");
}

TEST(Markdown, isATableUnderAHeading) {
  EXPECT_EQ(toMarkdown(table()),
            "## Sizes\n\n| row | bytes | PSNR |\n|---|--:|--:|\n| a, \"b\" | 48214 | 44.71 |\n"
            "| c\\|d | - | exact |\n");
}

TEST(Markdown, escapesTextOfUnknownOrigin) {
  EXPECT_EQ(markdownText("a_b|c`<d>\\[e]*\nf\x1b"), "a\\_b\\|c\\`\\<d\\>\\\\\\[e\\]\\* f?");
  EXPECT_EQ(markdownCode("plain"), "`plain`");
  EXPECT_EQ(markdownCode("a `b`` c\n"), "``` a `b`` c? ```");
  DataTable named = table();
  named.title = "<b>\n# x";
  named.rows[0][0] = std::string("[x](y)");
  const std::string text = toMarkdown(named);
  EXPECT_NE(text.find("## \\<b\\> \\# x\n"), std::string::npos) << text;
  EXPECT_NE(text.find("| \\[x\\](y) |"), std::string::npos) << text;
}

TEST(WithColumns, takesThemInTheirOrder) {
  const DataTable some = withColumns(table(), {"psnr", "name"});
  ASSERT_EQ(some.columns.size(), 2u);
  EXPECT_EQ(some.columns[0].key, "psnr");
  EXPECT_EQ(exactText(some.rows[0][1]), "a, \"b\"");
  EXPECT_THROW((void)withColumns(table(), {"colour"}), std::logic_error);
}

// Figures of a page.

FigureTable figures() {
  return {.table = {"Sizes & errors",
                    {{"name", "row", Kind::kText},
                     {"bytes", "bytes", Kind::kBytes, "size of the file"},
                     {"error", "error", Kind::kError},
                     {"fps", "FPS"},
                     {"note", "note", Kind::kText}},
                    {{std::string("<ESVR>"), 46000.0, 1.0 / 3.0, Cell(), std::string("one fit")},
                     {std::string("ZFP"), 45000.0, std::numeric_limits<double>::infinity(), Cell(),
                      std::string()},
                     {std::string("raw"), Cell(), Cell(), Cell(), std::string("out of reach")}}},
          .folded = {"note"},
          .reason = "note",
          .groups = {{"of one size", 2}, {"others", 1}},
          .emphasis = {Emphasis::kOurs, Emphasis::kRival},
          .best = {{0, 2}}};
}

TEST(HtmlTable, saysWhatItsHeadersAreOf) {
  const std::string html = toHtml(figures()).markup;
  EXPECT_THAT(html, HasSubstr("<caption><span>Sizes &amp; errors</span></caption>"));
  EXPECT_THAT(html, HasSubstr("<th scope=\"col\" title=\"size of the file\">bytes</th>"));
  EXPECT_THAT(html, HasSubstr("<th scope=\"row\">&lt;ESVR&gt;</th>"));
  EXPECT_THAT(html, HasSubstr("<th scope=\"rowgroup\" colspan=\"3\"><span>of one size</span>"));
}

TEST(HtmlTable, hasNumbersForReadersAndForScripts) {
  const std::string html = toHtml(figures()).markup;
  EXPECT_THAT(html, HasSubstr("data-value=\"0.3333333333333333\" class=\"best\">0.33</td>"));
  EXPECT_THAT(html, HasSubstr("<td data-value=\"46000\">46000</td>"));
  EXPECT_THAT(html, HasSubstr("data-value=\"Infinity\""));
}

TEST(HtmlTable, marksRows) {
  const std::string html = toHtml(figures()).markup;
  EXPECT_THAT(html, HasSubstr("<tr class=\"row ours\">"));
  EXPECT_THAT(html, HasSubstr("<tr class=\"row rival\">"));
}

TEST(HtmlTable, foldsFiguresAndLeavesEmptyColumnsOut) {
  const std::string html = toHtml(figures()).markup;
  EXPECT_THAT(html, HasSubstr("<dt>note</dt>\n<dd class=\"text\">one fit</dd>"));
  EXPECT_THAT(html, Not(HasSubstr(">note</th>")));
  EXPECT_THAT(html, Not(HasSubstr("FPS")));
}

TEST(HtmlTable, saysWhyARowHasNoFigures) {
  EXPECT_THAT(toHtml(figures()).markup,
              HasSubstr("<td class=\"reason\" colspan=\"2\">out of reach</td>"));
}

TEST(HtmlTable, mayHaveNoGroups) {
  FigureTable plain = figures();
  plain.groups.clear();
  const std::string html = toHtml(plain).markup;
  EXPECT_THAT(html, Not(HasSubstr("rowgroup")));
  EXPECT_THAT(html, HasSubstr("out of reach"));
}

Chart curves() {
  return {.title = "Error over size",
          .x = {"size of the file", Unit::kBytes, true},
          .y = {"error, %", Unit::kPercent, true},
          .series = {{.name = "ESVR",
                      .points = {{1e4, 0.5, "46.02 dB"}, {1e5, 0.02}},
                      .emphasis = Emphasis::kOurs},
                     {.name = "</script>", .points = {{2e4, 4.0}}, .joined = false}}};
}

json jsonOf(const Chart& chart) {
  const std::string html = toHtml(chart).markup, start = "<script type=\"application/json\">";
  const std::size_t begin = html.find(start) + start.size();
  return json::parse(html.substr(begin, html.find("</script>", begin) - begin));
}

TEST(Chart, SaysWhatItsAxesAndItsSeriesAre) {
  const json chart = jsonOf(curves());
  EXPECT_EQ(chart["x"],
            (json{{"label", "size of the file"}, {"unit", "bytes"}, {"logarithmic", true}}));
  EXPECT_EQ(chart["y"]["unit"], "percent");
  EXPECT_EQ(chart["y"]["decibels"], false);
  EXPECT_EQ(chart["series"][0]["points"],
            json::parse(R"([[1e4, 0.5, "46.02 dB"], [1e5, 0.02, ""]])"));
  EXPECT_EQ(chart["series"][0]["ours"], true);
  EXPECT_EQ(chart["series"][1]["joined"], false);
  EXPECT_THAT(toHtml(curves()).markup,
              HasSubstr("aria-label=\"Error over size: error, % over size of the file\""));
}

TEST(Chart, KeepsNamesFromEndingItsElement) {
  EXPECT_EQ(jsonOf(curves())["series"][1]["name"], "</script>");
}

TEST(Chart, PassesOverWhatCannotBeShown) {
  Chart with = curves();
  for (const double y : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                         std::numeric_limits<double>::infinity()})
    with.series[1].points.push_back({3e5, y});
  EXPECT_EQ(jsonOf(with)["series"][1]["points"].size(), 1u);
  with.y.logarithmic = false;
  EXPECT_EQ(jsonOf(with)["series"][1]["points"].size(), 3u);
}

TEST(Chart, IsThereWithoutCurves) {
  EXPECT_EQ(jsonOf(Chart{.title = "None"})["series"], json::array());
}

Image gray(const std::vector<float>& shares) {
  Image image{int(shares.size()), 1, {}};
  for (const float share : shares) image.rgba.insert(image.rgba.end(), {share, share, share, 1.0f});
  return image;
}

TEST(ErrorColors, areBrighterForLargerErrors) {
  std::vector<float> shares;
  for (int i = 0; i <= 100; ++i) shares.push_back(float(i) / 100.0f);
  Image map = gray(shares);
  colorErrors(map);
  double before = -1.0;
  for (std::size_t i = 0; i < map.rgba.size(); i += 4) {
    // The luma of ITU-R BT.601.
    const double luma = 0.299 * map.rgba[i] + 0.587 * map.rgba[i + 1] + 0.114 * map.rgba[i + 2];
    EXPECT_GT(luma, before) << i;
    EXPECT_EQ(map.rgba[i + 3], 1.0f);
    before = luma;
  }
}

TEST(ErrorColors, beginWithBlackAndEndWithTheLastColor) {
  Image map = gray({0.0f, 1.0f, 7.0f});
  colorErrors(map);
  EXPECT_EQ(map.rgba[0], 0.0f);
  EXPECT_EQ(map.rgba[4], 1.0f);
  EXPECT_EQ(map.rgba[6], map.rgba[10]) << "larger errors have the last color too";
}

TEST(ErrorScale, hasTheColorsOfTheMap) {
  // A quarter of the scale is the color of a sixteenth of the error, as colors follow its root.
  Image map = gray({1.0f / 16.0f});
  colorErrors(map);
  const auto level = [&](std::size_t c) {
    return std::to_string(int(map.rgba[c] * 255.0f + 0.5f));
  };
  EXPECT_THAT(errorScale().markup,
              testing::HasSubstr("offset=\"0.25\" stop-color=\"rgb(" + level(0) + "," + level(1) +
                                 "," + level(2) + ")\""));
}

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

// Pages.

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
