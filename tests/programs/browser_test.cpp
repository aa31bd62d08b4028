// Plan: a page is opened in a real browser without a window. Scripts in the page click and drag as
// a reader does and write what they see into the page, which the browser prints.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/run_program.h"
#include "programs/page_figures.h"
#include "programs/pictures.h"

namespace esvr::report {
namespace {

using testing::HasSubstr;

std::string square() { return toPng(Image{64, 48, std::vector<float>(64 * 48 * 4, 0.5f)}); }

FigureTable rowsOfPage() {
  return {
      .table = {"Rows",
                {{"name", "row", Kind::kText},
                 {"bytes", "bytes", Kind::kBytes},
                 {"note", "note", Kind::kText}},
                {{std::string("ten"), 10.0, std::string("a")},
                 {std::string("none"), Cell(), std::string("b")},
                 {std::string("nine"), 9.0, std::string("c")},
                 {std::string("<script>document.title='hurt'</script>"), 100.0, std::string("d")}}},
      .folded = {"note"},
      .groups = {{"small", 3}, {"large", 1}}};
}

HtmlPage page() {
  const Chart chart{.title = "Curves",
                    .series = {{"ESVR", {{0.0, 1.0}, {1.0, 2.0}}}, {"ZFP", {{0.0, 5.0}}}}};
  PictureSheet sheet{.reference = {.name = "reference", .png = square()}};
  sheet.shots = {
      {.name = "fit", .png = square(), .errorPng = square(), .emphasis = Emphasis::kOurs}};
  return {.title = "A page & more",
          .finding = {},
          .paragraphs = {"One."},
          .sections = {section("figures", "Table", toHtml(rowsOfPage())),
                       section("charts", "Curves", toHtml(chart)),
                       section("pictures", "Pictures", toHtml(sheet))},
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
    const std::vector<std::string> arguments{"--headless",
                                             "--no-sandbox",
                                             "--disable-gpu",
                                             "--disable-dev-shm-usage",
                                             profile,
                                             "--window-size=1280,900",
                                             "--virtual-time-budget=2000",
                                             "--dump-dom",
                                             "file://" + (folder_ / "page.html").string()};
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
      "see([...document.querySelectorAll('tr.row')].map(r => "
      "r.cells[0].firstChild.nextSibling.textContent.slice(0, 4)).join(' '));";
  const std::string dom =
      after("const bytes = document.querySelectorAll('thead th')[1];" + names + "bytes.click();" +
            names + "see(document.querySelectorAll('tr.group')[0].offsetHeight);" +
            "see(document.querySelector('.where').textContent);" + "bytes.click();" + names +
            "bytes.click();" + names + "document.querySelectorAll('thead th')[0].click();" + names);
  EXPECT_THAT(dom, HasSubstr("[ten none nine &lt;scr]"
                             "[nine ten &lt;scr none][0][small]"
                             "[&lt;scr ten nine none]"
                             "[ten none nine &lt;scr]"
                             "[&lt;scr nine none ten]"));
  EXPECT_THAT(dom, HasSubstr("<title>A page &amp; more</title>")) << "no text became a script";
}

TEST_F(Browser, SlowKeepsHeadersInSight) {
  const std::string dom = after(
      "for (const cell of document.querySelectorAll('tr.row td')) cell.style.height = '900px';"
      "scrollTo(0, 1500);"
      "see(Math.round(document.querySelector('thead th').getBoundingClientRect().top));"
      "see(document.querySelector('h1').getBoundingClientRect().top < -1000);");
  EXPECT_THAT(dom, HasSubstr("[0][true]"));
}

TEST_F(Browser, SlowUnfoldsTheFiguresOfARow) {
  const std::string dom = after(
      "const more = document.querySelector('tr.more'), button = document.querySelector('.unfold');"
      "see(more.offsetHeight > 0); button.click(); see(more.offsetHeight > 0);"
      "see(button.getAttribute('aria-expanded'));");
  EXPECT_THAT(dom, HasSubstr("[false][true][true]"));
}

// uPlot moves its cursor in the next frame.
TEST_F(Browser, SlowReadsOutPoints) {
  const std::string dom = after(
      "const over = document.querySelector('.chart .u-over'), box = over.getBoundingClientRect();"
      "see(document.querySelectorAll('.chart canvas').length);"
      "const at = {clientX: box.right - 2, clientY: box.top + 9, bubbles: true};"
      "over.dispatchEvent(new MouseEvent('mouseenter', at));"
      "over.dispatchEvent(new MouseEvent('mousemove', at));"
      "setTimeout(() => see([...document.querySelectorAll('.u-value')].map("
      "v => v.textContent).join('; ')), 200);");
  EXPECT_THAT(dom, HasSubstr("[1]"));
  EXPECT_THAT(dom, HasSubstr("1, 2; 0, 5]")) << "ZFP has one point";
}

TEST_F(Browser, SlowZoomsAllPicturesTogether) {
  const std::string dom = after(
      "for (const image of document.images) see(image.naturalWidth + 'x' + image.naturalHeight);"
      "const panes = [...document.querySelectorAll('.pane')], zoom = "
      "document.querySelector('.tools input');"
      "const widths = () => new Set([...document.querySelectorAll('.pane img')].map(i => "
      "Math.round(i.getBoundingClientRect().width / i.closest('.pane').offsetWidth * 100)));"
      "see([...widths()]); zoom.value = 2; zoom.dispatchEvent(new Event('input'));"
      "see([...widths()]); document.querySelector('.tools button').click(); see([...widths()]);");
  EXPECT_THAT(dom, HasSubstr("[64x48][64x48][64x48][64x48][64x48][100][400][100]"));
}

TEST_F(Browser, SlowMovesTheBorderOfTheHalves) {
  const std::string dom = after(
      "const range = document.querySelector('.shot input'); range.value = 20;"
      "range.dispatchEvent(new Event('input'));"
      "see(getComputedStyle(document.querySelector('.over')).clipPath);");
  EXPECT_THAT(dom, HasSubstr("[inset(0px 0px 0px 20%)]"));
}

/// A window of the browser cannot be as narrow as a phone, but a frame can.
TEST_F(Browser, SlowFitsIntoScreensOfAnyWidth) {
  std::string inner = toHtml(page());
  inner.insert(
      inner.rfind("</body>"),
      "<script>addEventListener('load', () => { const root = document.documentElement;"
      "const charts = [...document.querySelectorAll('.chart canvas')];"
      "parent.postMessage(root.clientWidth + ' ' + (root.scrollWidth <= root.clientWidth) +"
      " ' ' + charts.map(c => c.clientWidth > 200 && c.clientWidth < root.clientWidth), '*'); });"
      "</script>");
  test::writeText(folder_ / "inner.html", inner);
  for (const std::string width : {"390", "800", "1600", "2560"}) {
    const std::string dom =
        after(std::string("addEventListener('message', event => see(event.data));"
                          "const frame = document.createElement('iframe'); frame.width = ") +
              width +
              "; frame.height = 4000; frame.src = 'inner.html'; frame.style.border = 0;"
              "document.body.append(frame);");
    EXPECT_THAT(dom, HasSubstr("[" + width + " true true]"));
  }
}

TEST_F(Browser, SlowNeedsNothingFromElsewhere) {
  const std::string dom = after(
      "see(performance.getEntriesByType('resource').filter(e => "
      "!e.name.startsWith('data:')).length);");
  EXPECT_THAT(dom, HasSubstr("[0]"));
}

}  // namespace
}  // namespace esvr::report
