// Tables of figures as text, Markdown and comma-separated values; pages in HTML, and the encodings of what they hold; and
// what a page shows: tables, charts, pictures and maps of their errors.

#include "programs/page_figures.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "esvr/grid.h"
#include "programs/option_values.h"
#include "programs/pictures.h"
#include "programs/run_main.h"

namespace esvr::report {

std::string plainText(double value) {
  std::array<char, 400> text;  // fixed notation of any double
  const double rounded = std::strtod(cli::formatted("%.3g", value).c_str(), nullptr);
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), rounded, std::chars_format::fixed);
  return {text.data(), end.ptr};
}

std::string bytesText(double bytes) {
  constexpr std::array kUnits{" B", " KB", " MB", " GB", " TB"};
  constexpr double kNext = 999.5;  // is rounded to 1000
  std::size_t unit = 0;
  for (; bytes >= kNext && unit + 1 < kUnits.size(); ++unit) bytes /= 1000.0;
  return plainText(bytes) + kUnits[unit];
}

namespace {

using cli::formatted;

std::string numberText(Kind kind, double value) {
  switch (kind) {
    case Kind::kBytes:
      return formatted("%.0f", value);
    case Kind::kMegabytes:
      return formatted("%.3g", value / 1e6);
    case Kind::kDecibels:
      return cli::decibels(value);
    case Kind::kError:
      return formatted("%.2g", value);
    case Kind::kShare:
      return formatted("%.4f", value);
    default:
      return formatted("%.3g", value);
  }
}

std::string csvField(const std::string& given) {
  const std::string text = shownText(given, LineEnds::kKeep);
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

template <class FieldOf>
std::string line(std::size_t fields, const char* before, const char* between, const char* after,
                 const FieldOf& fieldOf) {
  std::string text = before;
  for (std::size_t i = 0; i < fields; ++i) text += (i == 0 ? "" : between) + fieldOf(i);
  return text + after + '\n';
}

std::string markdownLine(std::size_t fields, const auto& fieldOf) {
  return line(fields, "| ", " | ", " |", fieldOf);
}

}  // namespace

std::string cellText(const Column& column, const Cell& cell) {
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  if (const auto* value = std::get_if<double>(&cell)) return numberText(column.kind, *value);
  return "-";
}

std::string exactText(const Cell& cell) {
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  const auto* value = std::get_if<double>(&cell);
  if (!value) return {};
  if (std::isinf(*value)) return *value > 0 ? "inf" : "-inf";
  return cli::exactNumber(*value);
}

DataTable withColumns(const DataTable& table, const std::vector<std::string>& keys) {
  DataTable result{table.title, {}, std::vector<Row>(table.rows.size())};
  for (const auto& key : keys) {
    const auto column = std::find_if(table.columns.begin(), table.columns.end(),
                                     [&](const Column& c) { return c.key == key; });
    if (column == table.columns.end()) throw std::logic_error("the table has no column " + key);
    result.columns.push_back(*column);
    const auto at = std::size_t(column - table.columns.begin());
    for (std::size_t r = 0; r < table.rows.size(); ++r) result.rows[r].push_back(table.rows[r][at]);
  }
  return result;
}

std::string markdownText(const std::string& text) {
  constexpr std::string_view kMarkup = "\\`*_[]<>|~&$#";
  std::string escaped;
  for (const char c : shownText(text, LineEnds::kKeep)) {
    if (kMarkup.find(c) != std::string_view::npos) escaped += '\\';
    escaped += c == '\n' ? ' ' : c;
  }
  return escaped;
}

std::string markdownCode(const std::string& text) {
  const std::string shown = shownText(text, LineEnds::kReplace);
  std::size_t longest = 0, run = 0;
  for (const char c : shown) longest = std::max(longest, run = c == '`' ? run + 1 : 0);
  const std::string fence(longest + 1, '`');
  return longest == 0 ? fence + shown + fence : fence + ' ' + shown + ' ' + fence;
}

std::string toCsv(const DataTable& table) {
  const std::size_t n = table.columns.size();
  const auto csvLine = [&](const auto& fieldOf) { return line(n, "", ",", "", fieldOf); };
  std::string text = csvLine([&](std::size_t i) { return csvField(table.columns[i].key); });
  for (const auto& row : table.rows)
    text += csvLine([&](std::size_t i) { return csvField(exactText(row[i])); });
  return text;
}

std::string toMarkdown(const DataTable& table) {
  const std::size_t n = table.columns.size();
  std::string text = table.title.empty() ? "" : "## " + markdownText(table.title) + "\n\n";
  text += markdownLine(n, [&](std::size_t i) { return markdownText(table.columns[i].header); });
  text += line(n, "|", "|", "|", [&](std::size_t i) {
    return std::string(table.columns[i].kind == Kind::kText ? "---" : "--:");
  });
  for (const auto& row : table.rows)
    text += markdownLine(
        n, [&](std::size_t i) { return markdownText(cellText(table.columns[i], row[i])); });
  return text;
}

// ---- Pages

std::string base64(std::string_view bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  constexpr std::size_t kGroup = 3, kDigitsPerGroup = 4, kDigitBits = 6;
  std::string text;
  for (std::size_t at = 0; at < bytes.size(); at += kGroup) {
    const std::size_t have = std::min(kGroup, bytes.size() - at);
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < kGroup; ++i)
      bits = bits << 8 | (i < have ? std::uint8_t(bytes[at + i]) : 0u);
    for (std::size_t i = 0; i < kDigitsPerGroup; ++i) {
      const std::uint32_t digit = bits >> (kDigitBits * (kDigitsPerGroup - 1 - i)) & 63u;
      text += i <= have ? kDigits[digit] : '=';
    }
  }
  return text;
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : shownText(text, LineEnds::kKeep)) switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  return result;
}

namespace {

/// Elements within a line: white space beside them would be seen.
constexpr std::array<std::string_view, 3> kInline{"button", "output", "span"};

std::string startTag(const char* name, const Attributes& attributes) {
  std::string tag = std::string("<") + name;
  for (const auto& attribute : attributes)
    tag += std::string(" ") + attribute.name + "=\"" + escaped(attribute.value) + '"';
  return tag + '>';
}

}  // namespace

Html& Html::operator+=(const Html& after) {
  markup += after.markup;
  return *this;
}

Html htmlText(std::string_view text) { return {escaped(text)}; }

Html element(const char* name, const Attributes& attributes, const Html& content) {
  const bool isInline = std::find(kInline.begin(), kInline.end(), name) != kInline.end();
  return {startTag(name, attributes) + content.markup + "</" + name + '>' + (isInline ? "" : "\n")};
}

Html element(const char* name, const Attributes& attributes, std::string_view text) {
  return element(name, attributes, htmlText(text));
}

Html element(const char* name, std::string_view text) { return element(name, {}, text); }

Html voidElement(const char* name, const Attributes& attributes) {
  return {startTag(name, attributes)};
}

namespace {

Html verbatim(const char* element, std::string_view content) {
  return {std::string("<") + element + ">" + std::string(content) + "</" + element + ">\n"};
}

Html headOf(const HtmlPage& page) {
  Html head = voidElement("meta", {{"charset", "utf-8"}});
  head += voidElement("meta",
                      {{"name", "viewport"}, {"content", "width=device-width, initial-scale=1"}});
  head += voidElement("meta", {{"name", "color-scheme"}, {"content", "light dark"}});
  head += element("title", page.title);
  head += verbatim("style", pageStyle());
  // Before anything is drawn, so that what only the script can unfold does not flash.
  head += verbatim("script", "document.documentElement.classList.add('scripted')");
  return element("head", {}, head);
}

/// Keeps a number and the word behind it, such as its unit, in one line.
std::string withWholeFigures(const std::string& text) {
  constexpr const char* kNoBreakSpace = "\u00a0";
  std::string result;
  for (const char c : text) {
    const bool behindDigit = !result.empty() && result.back() >= '0' && result.back() <= '9';
    result += c == ' ' && behindDigit ? kNoBreakSpace : std::string(1, c);
  }
  return result;
}

Html headerOf(const HtmlPage& page) {
  Html header;
  if (!page.finding.empty()) header += element("p", {{"class", "title"}}, page.title);
  header += element("h1", page.finding.empty() ? page.title : withWholeFigures(page.finding));
  for (const auto& paragraph : page.paragraphs)
    if (!paragraph.empty()) header += element("p", paragraph);
  return element("header", {}, header);
}

Html footerOf(const HtmlPage& page) {
  std::string lines;
  for (const auto& command : page.commands) lines += command + '\n';
  return section("commands", "Commands and versions", element("pre", lines));
}

}  // namespace

Html section(const char* kind, const std::string& heading, const Html& content) {
  Html body = element("h2", heading);
  body += content;
  return element("section", {{"class", kind}}, body);
}

std::string toHtml(const HtmlPage& page) {
  Html main = headerOf(page);
  for (const auto& part : page.sections) main += part;
  main += footerOf(page);
  Html body = element("main", {}, main);
  body += verbatim("script", pageScript());
  Html all = headOf(page);
  all += element("body", {}, body);
  return "<!DOCTYPE html>\n" + element("html", {{"lang", "en"}}, all).markup;
}

// ---- Figures

// Tables.

namespace {

/// The number of a cell in the form that scripts read.
std::string numberOf(const Cell& cell) {
  const auto* value = std::get_if<double>(&cell);
  if (value && std::isinf(*value)) return *value > 0 ? "Infinity" : "-Infinity";
  return value ? exactText(cell) : "";
}

Attributes attributesOf(const Column& column, const Cell& cell) {
  if (column.kind == Kind::kText) return {{"class", "text"}};
  return {{"data-value", numberOf(cell)}};
}

const std::string& meaningOf(const Column& column) {
  return column.meaning.empty() ? column.header : column.meaning;
}

/// Writes the rows of a table.
class TableWriter {
 public:
  explicit TableWriter(const FigureTable& figures) : figures_(figures) {
    for (std::size_t c = 0; c < columns().size(); ++c)
      if (c == 0 || hasFigures(c)) (isFolded(columns()[c]) ? folded_ : shown_).push_back(c);
  }

  [[nodiscard]] Html table() const {
    Html content = element("caption", {}, element("span", {}, figures_.table.title));
    content += element("thead", {}, element("tr", {}, headers()));
    content += bodies();
    return element("table", {{"class", figures_.sortable ? "sortable" : ""}}, content);
  }

 private:
  [[nodiscard]] const std::vector<Column>& columns() const { return figures_.table.columns; }

  [[nodiscard]] bool hasFigures(std::size_t c) const {
    const auto& rows = figures_.table.rows;
    return std::any_of(rows.begin(), rows.end(),
                       [&](const Row& row) { return !exactText(row[c]).empty(); });
  }

  [[nodiscard]] bool isFolded(const Column& column) const {
    return std::count(figures_.folded.begin(), figures_.folded.end(), column.key) != 0;
  }

  [[nodiscard]] std::string width() const { return std::to_string(shown_.size()); }

  [[nodiscard]] Html headers() const {
    Html cells;
    for (const std::size_t c : shown_) {
      const Column& column = columns()[c];
      Attributes attributes{{"scope", "col"}, {"title", meaningOf(column)}};
      if (column.kind == Kind::kText) attributes.push_back({"class", "text"});
      cells += element("th", attributes, column.header);
    }
    return cells;
  }

  [[nodiscard]] Html bodies() const {
    if (figures_.groups.empty()) return element("tbody", {}, rows(0, figures_.table.rows.size()));
    Html all;
    std::size_t begin = 0;
    for (const auto& group : figures_.groups) {
      Html body = groupRow(group.heading);
      body += rows(begin, begin + group.rows);
      all += element("tbody", {}, body);
      begin += group.rows;
    }
    return all;
  }

  [[nodiscard]] Html groupRow(const std::string& heading) const {
    const Attributes attributes{{"scope", "rowgroup"}, {"colspan", width()}};
    return element("tr", {{"class", "group"}},
                   element("th", attributes, element("span", {}, heading)));
  }

  [[nodiscard]] Html rows(std::size_t begin, std::size_t end) const {
    Html all;
    for (std::size_t r = begin; r < end; ++r) {
      all += row(r);
      if (!folded_.empty()) all += foldedRow(r);
    }
    return all;
  }

  [[nodiscard]] Html row(std::size_t r) const {
    const Row& cells = figures_.table.rows[r];
    const Emphasis emphasis = r < figures_.emphasis.size() ? figures_.emphasis[r] : Emphasis::kNone;
    Html content = element("th", {{"scope", "row"}}, cellText(columns().front(), cells.front()));
    content += isEmpty(cells) ? reasonOf(cells) : figuresOf(r);
    return element("tr", {{"class", std::string("row ") + classOf(emphasis)}}, content);
  }

  [[nodiscard]] bool isEmpty(const Row& cells) const {
    return std::all_of(shown_.begin() + 1, shown_.end(),
                       [&](std::size_t c) { return exactText(cells[c]).empty(); });
  }

  [[nodiscard]] Html reasonOf(const Row& cells) const {
    std::string reason;
    for (std::size_t c = 0; c < columns().size(); ++c)
      if (columns()[c].key == figures_.reason) reason = exactText(cells[c]);
    return element("td", {{"class", "reason"}, {"colspan", std::to_string(shown_.size() - 1)}},
                   reason);
  }

  [[nodiscard]] Html figuresOf(std::size_t r) const {
    Html all;
    for (const std::size_t c : shown_)
      if (c != 0) all += cell("td", {r, c});
    return all;
  }

  [[nodiscard]] Html cell(const char* name, const CellPlace& at) const {
    const Column& column = columns()[at.column];
    const Cell& content = figures_.table.rows[at.row][at.column];
    Attributes attributes = attributesOf(column, content);
    if (std::count(figures_.best.begin(), figures_.best.end(), at) != 0)
      attributes.push_back({"class", "best"});
    return element(name, attributes, cellText(column, content));
  }

  [[nodiscard]] Html foldedRow(std::size_t r) const {
    Html list;
    for (const std::size_t c : folded_) {
      if (exactText(figures_.table.rows[r][c]).empty()) continue;
      Html pair = element("dt", meaningOf(columns()[c]));
      pair += cell("dd", {r, c});
      list += element("div", {}, pair);
    }
    return element("tr", {{"class", "more"}},
                   element("td", {{"colspan", width()}}, element("dl", {}, list)));
  }

  const FigureTable& figures_;
  std::vector<std::size_t> shown_, folded_;  ///< places of columns
};

}  // namespace

Html toHtml(const FigureTable& figures) {
  // A region that scrolls must be reachable with the keyboard.
  const Attributes region{{"class", "scroll"},
                          {"tabindex", "0"},
                          {"role", "region"},
                          {"aria-label", figures.table.title}};
  return element("div", region, TableWriter(figures).table());
}

// Charts.

namespace {

using Json = nlohmann::ordered_json;

/// The names of units in charts.js.
const char* nameOf(Unit unit) {
  return cli::wordOf(unit, {{"bytes", Unit::kBytes},
                            {"seconds", Unit::kSeconds},
                            {"percent", Unit::kPercent},
                            {"none", Unit::kNone}});
}

bool holds(const ChartAxis& axis, double value) {
  return std::isfinite(value) && (!axis.logarithmic || value > 0.0);
}

Json toJson(const ChartAxis& axis) {
  return {{"label", axis.label}, {"unit", nameOf(axis.unit)}, {"logarithmic", axis.logarithmic}};
}

Json toJson(const Series& series, const Chart& chart) {
  Json points = Json::array();
  for (const Point& point : series.points)
    if (holds(chart.x, point.x) && holds(chart.y, point.y))
      points.push_back(Json::array({point.x, point.y, point.note}));
  return {{"name", series.name},
          {"ours", series.emphasis == Emphasis::kOurs},
          {"joined", series.joined},
          {"points", std::move(points)}};
}

/// The text of JSON within an element `script`, which no name can end.
std::string scriptText(const Json& json) {
  std::string text;
  for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace))
    text += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return text;
}

}  // namespace

Html toHtml(const Chart& chart) {
  Json json{{"x", toJson(chart.x)}, {"y", toJson(chart.y)}, {"series", Json::array()}};
  json["y"]["decibels"] = chart.decibels;
  for (const Series& series : chart.series) json["series"].push_back(toJson(series, chart));
  const std::string said = chart.title + ": " + chart.y.label + " over " + chart.x.label;
  Html content = element("figcaption", {}, element("h3", chart.title));
  content += element("div", {{"class", "drawing"}, {"role", "img"}, {"aria-label", said}}, Html{});
  content += Html{"<script type=\"application/json\">" + scriptText(json) + "</script>\n"};
  return element("figure", {{"class", "chart"}}, content);
}

// Maps of errors.

namespace {

using RampColor = std::array<double, 3>;

/// sRGB colors at equal distances. Each is brighter than the one before it.
constexpr std::array<RampColor, 5> kRamp{{{0.00, 0.00, 0.00},
                                          {0.30, 0.07, 0.48},
                                          {0.74, 0.19, 0.36},
                                          {0.98, 0.56, 0.10},
                                          {1.00, 0.98, 0.70}}};
constexpr std::array kScaleTicks{0.0, 0.005, 0.02, 0.05, 0.08, kMostError};

/// Where the color of an error is between the first color, at 0, and the last one, at 1.
double placeOf(double share) { return std::sqrt(std::clamp(share, 0.0, 1.0)); }

RampColor colorAt(double place) {
  const double at = place * double(kRamp.size() - 1);
  const std::size_t below = std::min(std::size_t(at), kRamp.size() - 2);
  const double part = at - double(below);
  RampColor color{};
  for (std::size_t c = 0; c < color.size(); ++c)
    color[c] = (1.0 - part) * kRamp[below][c] + part * kRamp[below + 1][c];
  return color;
}

Html gradient() {
  Html stops;
  for (std::size_t i = 0; i < kRamp.size(); ++i) {
    const auto level = [&](std::size_t c) { return std::to_string(levelOf(kRamp[i][c])); };
    stops += element("stop",
                     {{"offset", cli::formatted("%.2f", double(i) / double(kRamp.size() - 1))},
                      {"stop-color", "rgb(" + level(0) + "," + level(1) + "," + level(2) + ")"}},
                     Html{});
  }
  return element("linearGradient", {{"id", "error-colors"}}, stops);
}

}  // namespace

void colorErrors(Image& map) {
  for (std::size_t i = 0; i < map.rgba.size(); i += 4) {
    const RampColor color = colorAt(placeOf(double(map.rgba[i])));
    for (std::size_t c = 0; c < color.size(); ++c) map.rgba[i + c] = float(color[c]);
  }
}

Html errorScale() {
  constexpr double kWidth = 440.0, kEdge = 16.0, kHeight = 18.0, kText = 34.0;
  Html content = gradient();
  content += element("rect",
                     {{"class", "frame"},
                      {"x", cli::formatted("%.0f", kEdge)},
                      {"y", "1"},
                      {"width", cli::formatted("%.0f", kWidth)},
                      {"height", cli::formatted("%.0f", kHeight)},
                      {"style", "fill: url(#error-colors)"}},
                     Html{});
  for (const double tick : kScaleTicks)
    content += element("text",
                       {{"x", cli::formatted("%.1f", kEdge + kWidth * placeOf(tick / kMostError))},
                        {"y", cli::formatted("%.0f", kText)},
                        {"text-anchor", "middle"}},
                       cli::formatted("%g", tick));
  const std::string most = cli::formatted("%g", kMostError);
  Html figure =
      element("svg",
              {{"viewBox", "0 0 480 40"},
               {"role", "img"},
               {"aria-label", "colors of errors from 0 (black) to " + most + " (light yellow)"}},
              content);
  figure += element("figcaption",
                    "Error maps: the largest difference of a pixel's channels, which are between 0 "
                    "and 1. Errors above " +
                        most + " have the last color.");
  return element("figure", {{"class", "scale"}}, figure);
}

// Pictures.

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
