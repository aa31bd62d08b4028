#include "report/html_page.h"

#include <cmath>

#include "report/base64.h"
#include "report/escape.h"

namespace esvr::report {
namespace {

constexpr const char* kStyle = R"(
body { font: 15px/1.5 system-ui, sans-serif; margin: 2em auto; max-width: 76em; padding: 0 1em; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th, td { padding: .25em .6em; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap; }
th.text, td.text { text-align: left; }
th { cursor: pointer; position: sticky; top: 0; background: #fff; user-select: none; }
th[aria-sort=ascending]::after { content: " \25b2"; }
th[aria-sort=descending]::after { content: " \25bc"; }
.scroll { overflow-x: auto; }
figure { margin: 1.5em 0; }
.sheet { display: flex; flex-wrap: wrap; gap: 0 1em; align-items: flex-end; }
figure img { max-width: 100%; }
.pair { position: relative; display: inline-block; background: #fff; }
.pair img { display: block; max-width: 100%; }
.pair img + img { position: absolute; left: 0; top: 0; clip-path: inset(0 0 0 50%); }
pre { background: #f4f4f4; padding: 1em; overflow-x: auto; }
)";

// A click on a header sorts by this column, numbers by value and rows without a figure last;
// another click reverses the order. A slider hides the left part of the candidate's picture.
constexpr const char* kScript = R"(
function sortBy(header) {
  const table = header.closest('table'), body = table.tBodies[0], at = header.cellIndex;
  const down = header.getAttribute('aria-sort') === 'ascending';
  for (const other of header.parentNode.cells) other.removeAttribute('aria-sort');
  header.setAttribute('aria-sort', down ? 'descending' : 'ascending');
  const key = row => {
    const value = row.cells[at].dataset.value;
    return value === undefined ? row.cells[at].textContent : value === '' ? null : Number(value);
  };
  const order = (a, b) => {
    const x = key(a), y = key(b);
    if (x === null || y === null) return (x === null) - (y === null);
    const sign = typeof x === 'string' ? x.localeCompare(y) : x === y ? 0 : x < y ? -1 : 1;
    return down ? -sign : sign;
  };
  for (const row of [...body.rows].sort(order)) body.append(row);
}
for (const header of document.querySelectorAll('th'))
  header.addEventListener('click', () => sortBy(header));
for (const range of document.querySelectorAll('input[type=range]'))
  range.addEventListener('input', () => {
    range.closest('figure').querySelector('.pair img + img').style.clipPath =
      `inset(0 0 0 ${range.value}%)`;
  });
)";

std::string tag(const std::string& name, const std::string& text) {
  return "<" + name + ">" + escaped(text) + "</" + name + ">\n";
}

const char* classOf(const Column& column) {
  return column.kind == Kind::kText ? " class=\"text\"" : "";
}

/// The attribute with the number by which a cell is sorted: none for text, empty if there is no
/// figure.
std::string sortValue(const Column& column, const Cell& cell) {
  if (column.kind == Kind::kText) return {};
  const auto* value = std::get_if<double>(&cell);
  if (!value) return " data-value=\"\"";
  const std::string number =
      std::isinf(*value) ? (*value > 0 ? "Infinity" : "-Infinity") : exactText(cell);
  return " data-value=\"" + number + "\"";
}

std::string tableOf(const DataTable& table) {
  std::string text = table.title.empty() ? "" : tag("h2", table.title);
  text += "<div class=\"scroll\"><table>\n<thead><tr>";
  for (const auto& column : table.columns)
    text += std::string("<th") + classOf(column) + ">" + escaped(column.header) + "</th>";
  text += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    text += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i)
      text += std::string("<td") + classOf(table.columns[i]) + sortValue(table.columns[i], row[i]) +
              ">" + escaped(cellText(table.columns[i], row[i])) + "</td>";
    text += "</tr>\n";
  }
  return text + "</tbody>\n</table></div>\n";
}

std::string imageOf(const Picture& picture) {
  return "<img alt=\"" + escaped(picture.caption) + "\" src=\"data:" + picture.type + ";base64," +
         base64(picture.bytes) + "\">";
}

std::string figureOf(const std::string& content, const std::string& caption) {
  return "<figure>" + content + "<figcaption>" + escaped(caption) + "</figcaption></figure>\n";
}

std::string sliderOf(const Slider& slider) {
  return figureOf("<div class=\"pair\">" + imageOf(slider.reference) + imageOf(slider.candidate) +
                      "</div><br><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" "
                      "aria-label=\"border between reference and candidate\">",
                  slider.caption);
}

}  // namespace

std::string toHtml(const HtmlPage& page) {
  std::string text =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta "
      "name=\"viewport\" content=\"width=device-width\">\n" +
      tag("title", page.title) + "<style>" + kStyle + "</style>\n</head>\n<body>\n" +
      tag("h1", page.title);
  for (const auto& paragraph : page.paragraphs) text += tag("p", paragraph);
  for (const auto& table : page.tables) text += tableOf(table);
  text += "<div class=\"sheet\">\n";
  for (const auto& picture : page.pictures) text += figureOf(imageOf(picture), picture.caption);
  text += "</div>\n";
  for (const auto& slider : page.sliders) text += sliderOf(slider);
  std::string commands;
  for (const auto& command : page.commands) commands += command + '\n';
  text += tag("h2", "Commands and versions") + tag("pre", commands);
  return text + "<script>" + kScript + "</script>\n</body>\n</html>\n";
}

}  // namespace esvr::report
