#include "report/html_chart.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "report/data_table.h"

namespace esvr::report {
namespace {

constexpr std::size_t kCurveColors = 10;  // curve-1 to curve-10 in page.css
constexpr double kLetter = 7.4;           // width of a letter of a label, in units of the view box
constexpr std::size_t kMostMarkers = 40;  // more markers would hide the line

/// The size of a drawing in units of its view box, and how many ticks have room.
struct Form {
  const char* name;
  double width, height;
  int ticksX, ticksY;
};
constexpr std::array kForms{Form{"wide", 640.0, 380.0, 8, 8}, Form{"narrow", 400.0, 340.0, 7, 7}};

/// A length or a position with a tenth of a unit.
std::string lengthText(double value) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.1f", value);
  return text.data();
}

std::string curveClass(std::size_t series, const Series& given) {
  return "curve curve-" + std::to_string(series % kCurveColors + 1) + " " + classOf(given.emphasis);
}

class ChartWriter {
 public:
  ChartWriter(const Plot& plot, const Form& form)
      : plot_(plot), form_(form), axes_(plot), left_(leftMargin()) {}

  [[nodiscard]] Html svg() const {
    Html content = element("g", {{"class", "grid"}}, grid());
    content += labels();
    for (const bool ours : {false, true})  // ESVR is in front of the others
      for (std::size_t i = 0; i < plot_.series.size(); ++i)
        if ((plot_.series[i].emphasis == Emphasis::kOurs) == ours) content += curve(i);
    const std::string box = "0 0 " + lengthText(form_.width) + " " + lengthText(form_.height);
    return element("svg",
                   {{"class", form_.name},
                    {"viewBox", box},
                    {"role", "img"},
                    {"aria-label", plot_.title + ": " + plot_.yLabel + " over " + plot_.xLabel}},
                   content);
  }

 private:
  static constexpr double kRight = 14.0, kRightScale = 56.0, kTop = 12.0, kBottom = 46.0;
  static constexpr double kTextSize = 13.0, kTickGap = 7.0, kRadius = 3.5, kOurRadius = 5.5;

  /// Room for the labels of y and its name. Without fonts, the width of a letter is an estimate.
  [[nodiscard]] double leftMargin() const {
    constexpr double kName = 26.0;
    std::size_t letters = 0;
    for (const Tick& tick : axes_.y.ticks(form_.ticksY))
      letters = std::max(letters, labelOf(tick, plot_.textY).size());
    return kName + kLetter * double(letters);
  }

  [[nodiscard]] double right() const {
    return form_.width - (plot_.rightTicks.empty() ? kRight : kRightScale);
  }
  [[nodiscard]] double bottom() const { return form_.height - kBottom; }
  [[nodiscard]] double placeX(double x) const {
    return left_ + axes_.x.place(x) * (right() - left_);
  }
  [[nodiscard]] double placeY(double y) const {
    return bottom() - axes_.y.place(y) * (bottom() - kTop);
  }

  [[nodiscard]] static Html line(double x0, double y0, double x1, double y1) {
    return element("line",
                   {{"x1", lengthText(x0)},
                    {"y1", lengthText(y0)},
                    {"x2", lengthText(x1)},
                    {"y2", lengthText(y1)}},
                   Html{});
  }

  [[nodiscard]] static Html text(const std::string& shown, double x, double y, const char* anchor) {
    return element("text", {{"x", lengthText(x)}, {"y", lengthText(y)}, {"text-anchor", anchor}},
                   shown);
  }

  /// A text that runs upwards in the middle of the frame's height.
  [[nodiscard]] Html textUpwards(const std::string& shown, double x) const {
    const std::string place = lengthText(x) + " " + lengthText((kTop + bottom()) / 2);
    return element("text",
                   {{"transform", "translate(" + place + ") rotate(-90)"},
                    {"text-anchor", "middle"},
                    {"class", "label"}},
                   shown);
  }

  [[nodiscard]] Html grid() const {
    Html lines;
    for (const Tick& tick : axes_.x.ticks(form_.ticksX))
      lines += line(placeX(tick.value), kTop, placeX(tick.value), bottom());
    for (const Tick& tick : axes_.y.ticks(form_.ticksY))
      lines += line(left_, placeY(tick.value), right(), placeY(tick.value));
    return lines;
  }

  /// The labels below the chart, without those that would touch the one before.
  [[nodiscard]] Html labelsX() const {
    Html all;
    double end = 0.0;
    for (const Tick& tick : axes_.x.ticks(form_.ticksX)) {
      const std::string label = labelOf(tick, plot_.textX);
      const double x = placeX(tick.value), half = kLetter * double(label.size()) / 2;
      if (x - half < end) continue;
      all += text(label, x, bottom() + kTextSize + kTickGap / 2, "middle");
      end = x + half + kTickGap;
    }
    return all;
  }

  [[nodiscard]] Html labels() const {
    Html all = labelsX();
    for (const Tick& tick : axes_.y.ticks(form_.ticksY))
      all += text(labelOf(tick, plot_.textY), left_ - kTickGap, placeY(tick.value) + kTextSize / 3,
                  "end");
    for (const Tick& tick : plot_.rightTicks)
      if (axes_.y.holds(tick.value))
        all += text(tick.label, right() + kTickGap, placeY(tick.value) + kTextSize / 3, "start");
    Html axes = element("g", {{"class", "ticks"}}, all);
    axes += text(plot_.xLabel, (left_ + right()) / 2, form_.height - kTickGap, "middle");
    axes += textUpwards(plot_.yLabel, kTextSize);
    if (!plot_.rightLabel.empty())
      axes += textUpwards(plot_.rightLabel, form_.width - kTickGap / 2);
    return axes;
  }

  [[nodiscard]] Html curve(std::size_t i) const {
    const Series& series = plot_.series[i];
    Html content;
    if (series.joined) content += element("polyline", {{"points", path(series)}}, Html{});
    for (const Point& point : series.points)
      if (axes_.hold(point)) content += marker(series, point);
    if (series.emphasis == Emphasis::kOurs) content += nameOf(series);
    return element("g", {{"class", curveClass(i, series)}, {"data-curve", std::to_string(i)}},
                   content);
  }

  /// The name beside the last point.
  [[nodiscard]] Html nameOf(const Series& series) const {
    const Point* last = nullptr;
    for (const Point& point : series.points)
      if (axes_.hold(point)) last = &point;
    if (!last) return {};
    const double x = placeX(last->x);
    const bool atRight = x > (left_ + right()) / 2;
    return element("text",
                   {{"class", "direct"},
                    {"x", lengthText(atRight ? x - kTickGap : x + kTickGap)},
                    {"y", lengthText(placeY(last->y) - kTickGap)},
                    {"text-anchor", atRight ? "end" : "start"}},
                   series.name);
  }

  [[nodiscard]] std::string path(const Series& series) const {
    std::string points;
    for (const Point& point : series.points)
      if (axes_.hold(point))
        points += (points.empty() ? "" : " ") + lengthText(placeX(point.x)) + "," +
                  lengthText(placeY(point.y));
    return points;
  }

  [[nodiscard]] Html marker(const Series& series, const Point& point) const {
    Attributes attributes{
        {"cx", lengthText(placeX(point.x))},
        {"cy", lengthText(placeY(point.y))},
        {"r", lengthText(series.emphasis == Emphasis::kOurs ? kOurRadius : kRadius)}};
    if (series.points.size() > kMostMarkers) attributes.push_back({"class", "hidden"});
    const std::string x = plot_.textX ? plot_.textX(point.x) : exactText(Cell(point.x));
    const std::string y = plot_.textY ? plot_.textY(point.y) : exactText(Cell(point.y));
    std::string said = series.name + "\n" + x + ", " + y;
    if (!point.note.empty()) said += "\n" + point.note;
    return element("circle", attributes, element("title", said));
  }

  const Plot& plot_;
  const Form& form_;
  PlotAxes axes_;
  double left_;
};

Html legendOf(const Plot& plot) {
  Html items;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const Series& series = plot.series[i];
    Html item = element("span", {{"class", "swatch " + curveClass(i, series)}}, Html{});
    item += element("span", {{"class", "label"}}, series.name);
    items += element("li", {{"class", classOf(series.emphasis)}, {"data-curve", std::to_string(i)}},
                     item);
  }
  return element("ul", {{"class", "legend"}}, items);
}

}  // namespace

Html toHtml(const Plot& plot) {
  Html content = element("figcaption", {}, element("h3", plot.title));
  for (const Form& form : kForms) content += ChartWriter(plot, form).svg();
  content += element("output", {{"class", "readout"}, {"aria-live", "polite"}}, Html{});
  content += legendOf(plot);
  return element("figure", {{"class", "chart"}}, content);
}

}  // namespace esvr::report
