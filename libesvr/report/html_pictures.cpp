#include "report/html_pictures.h"

#include "report/base64.h"
#include "report/error_colors.h"

namespace esvr::report {
namespace {

Html imageOf(const std::string& png, const std::string& shows) {
  return voidElement("img", {{"alt", shows}, {"src", "data:image/png;base64," + base64(png)}});
}

Html paneOf(const Html& content) { return element("div", {{"class", "pane"}}, content); }

Html captionOf(const Shot& shot) {
  Html caption = element("strong", shot.name);
  if (!shot.figures.empty()) caption += element("span", shot.figures);
  return element("figcaption", {}, caption);
}

/// The reference and a picture in front of each other.
Html halvesOf(const Shot& reference, const Shot& shot) {
  Html images = imageOf(reference.png, "left half: " + reference.name);
  images += element("div", {{"class", "over"}}, imageOf(shot.png, "right half: " + shot.name));
  return paneOf(images);
}

/// Moves the border between the halves.
Html borderSlider(const Shot& reference, const Shot& shot) {
  Html label = element(
      "span", "Last picture: " + reference.name + " on the left, " + shot.name + " on the right");
  label += voidElement("input", {{"type", "range"}, {"min", "0"}, {"max", "100"}, {"value", "50"}});
  return element("label", {}, label);
}

Html figureOf(const Shot& shot, const Shot& reference) {
  const bool ours = shot.emphasis == Emphasis::kOurs;
  Html panes = paneOf(imageOf(shot.png, shot.name));
  if (!shot.errorPng.empty()) panes += paneOf(imageOf(shot.errorPng, "errors of " + shot.name));
  if (ours) panes += halvesOf(reference, shot);
  Html all = element("div", {{"class", "panes"}}, panes);
  if (ours) all += borderSlider(reference, shot);
  all += captionOf(shot);
  return element("figure", {{"class", std::string("shot ") + classOf(shot.emphasis)}}, all);
}

Html sheetOf(const Html& figures) { return element("div", {{"class", "sheet"}}, figures); }

/// The controls of the zoom, which only the script can show. The slider is that of the exponent.
Html tools() {
  Html label = htmlText("Zoom ");
  label += voidElement(
      "input", {{"type", "range"}, {"min", "0"}, {"max", "4"}, {"step", "0.25"}, {"value", "0"}});
  Html content = element("label", {}, label);
  content += element("button", {{"type", "button"}}, "Whole pictures");
  content +=
      element("span", {{"class", "note"}},
              "All pictures show the same part. Drag to move it; a double click, or the wheel "
              "with Ctrl, enlarges it.");
  return element("div", {{"class", "tools"}}, content);
}

}  // namespace

Html toHtml(const PictureSheet& sheet) {
  Html content = element("p", {{"class", "note"}}, sheet.caption);
  content += tools();
  content += errorScale();
  Html figures = figureOf(sheet.reference, sheet.reference);
  for (const auto& shot : sheet.shots) figures += figureOf(shot, sheet.reference);
  content += sheetOf(figures);
  if (sheet.others.empty()) return content;
  Html others;
  for (const auto& shot : sheet.others) others += figureOf(shot, sheet.reference);
  Html folded = element("summary", "Pictures of the other rows");
  folded += sheetOf(others);
  content += element("details", {}, folded);
  return content;
}

}  // namespace esvr::report
