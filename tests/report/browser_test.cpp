// Plan: a page is opened in a real browser without a window. Scripts in the page click and drag as
// a reader does and write what they see into the page, which the browser prints.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/run_program.h"
#include "report/html_page.h"

namespace esvr::report {
namespace {

using testing::HasSubstr;
using testing::Not;

/// An SVG picture of one color.
Picture square(const std::string& color) {
  return {color, "image/svg+xml",
          "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"64\" height=\"48\"><rect width=\"64\" "
          "height=\"48\" fill=\"" +
              color + "\"/></svg>"};
}

HtmlPage page() {
  const DataTable table{"Rows",
                        {{"name", "row", Kind::kText}, {"bytes", "bytes", Kind::kBytes}},
                        {{std::string("ten"), 10.0},
                         {std::string("none"), Cell()},
                         {std::string("nine"), 9.0},
                         {std::string("<script>document.title='hurt'</script>"), 100.0}}};
  return {.title = "A page & more",
          .paragraphs = {"One."},
          .tables = {table},
          .pictures = {square("red")},
          .sliders = {{"both", square("green"), square("blue")}},
          .commands = {"esvr-compare table a.vdb", "esvr 0.1.0"}};
}

/// Opens the page in the browser and runs `script` in it. The script's function see(text) records a
/// text.
class Browser : public testing::Test {
 protected:
  void SetUp() override {
    if (std::string(ESVR_BROWSER).empty()) GTEST_SKIP() << "there is no chromium to open pages in";
  }
  std::string after(const std::string& script) {
    std::string text = toHtml(page());
    const std::string added =
        "<pre id=\"seen\"></pre><script>addEventListener('load', () => { const see = text => "
        "document.getElementById('seen').textContent += '[' + text + ']'; " +
        script + " });</script>";
    text.insert(text.rfind("</body>"), added);
    test::writeText(folder_ / "page.html", text);
    const std::string profile = "--user-data-dir=" + (folder_ / "profile").string();
    const std::vector<std::string> arguments{
        "--headless",    "--no-sandbox",
        "--disable-gpu", "--disable-dev-shm-usage",
        profile,         "--virtual-time-budget=2000",
        "--dump-dom",    "file://" + (folder_ / "page.html").string()};
    auto run = test::runProgram(ESVR_BROWSER, arguments);
    for (int n = 1; run.exitCode != 0 && n < kAttempts; ++n)
      run = test::runProgram(ESVR_BROWSER, arguments);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return run.out;
  }
  /// The browser itself fails now and then on a machine that is busy, whatever the page is.
  static constexpr int kAttempts = 3;
  test::TemporaryFolder folder_;
};

TEST_F(Browser, SlowSortsByTheColumnThatIsClicked) {
  const std::string names =
      "see([...document.querySelectorAll('tbody tr')].map(r => r.cells[0].textContent.slice(0, "
      "4)).join(' '));";
  const std::string dom =
      after("const bytes = document.querySelectorAll('th')[1];" + names + "bytes.click();" + names +
            "bytes.click();" + names + "document.querySelectorAll('th')[0].click();" + names);
  EXPECT_THAT(dom, HasSubstr("[ten none nine &lt;scr]"
                             "[nine ten &lt;scr none]"
                             "[&lt;scr ten nine none]"
                             "[&lt;scr nine none ten]"));
  EXPECT_THAT(dom, HasSubstr("<title>A page &amp; more</title>")) << "no text became a script";
}

TEST_F(Browser, SlowShowsItsPicturesAndMovesTheirBorder) {
  const std::string dom = after(
      "for (const image of document.images) see(image.naturalWidth + 'x' + image.naturalHeight);"
      "const range = document.querySelector('input[type=range]'); range.value = 20;"
      "range.dispatchEvent(new Event('input'));"
      "see(document.querySelector('.pair img + img').style.clipPath);");
  EXPECT_THAT(dom, HasSubstr("[64x48][64x48][64x48][inset(0px 0px 0px 20%)]"));
}

TEST_F(Browser, SlowNeedsNothingFromElsewhere) {
  const std::string dom = after(
      "see(performance.getEntriesByType('resource').filter(e => "
      "!e.name.startsWith('data:')).length);");
  EXPECT_THAT(dom, HasSubstr("[0]"));
  EXPECT_THAT(toHtml(page()), Not(HasSubstr("http://www.w3.org/1999")));
}

}  // namespace
}  // namespace esvr::report
