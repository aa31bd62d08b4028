#include "report/plot.h"

#include <cairo-svg.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "esvr/grid_names.h"
#include "report/cairo_surface.h"

namespace esvr::report {
namespace {

struct Rgb {
  double r, g, b;
};
/// The colors of Okabe and Ito, which color-blind people can distinguish, without yellow.
constexpr std::array kPalette{Rgb{0.00, 0.45, 0.70}, Rgb{0.84, 0.37, 0.00}, Rgb{0.00, 0.62, 0.45},
                              Rgb{0.80, 0.47, 0.65}, Rgb{0.00, 0.00, 0.00}, Rgb{0.34, 0.71, 0.91},
                              Rgb{0.90, 0.62, 0.00}, Rgb{0.50, 0.50, 0.50}, Rgb{0.45, 0.20, 0.55},
                              Rgb{0.45, 0.55, 0.10}};
constexpr Rgb kInk{0.1, 0.1, 0.1}, kGrid{0.88, 0.88, 0.88};

constexpr double kTextSize = 13.0, kTitleSize = 16.0, kLine = 1.8, kThickLine = 3.6, kHair = 1.0,
                 kMarker = 3.2;
constexpr double kLeft = 74.0, kRight = 18.0, kRightScale = 58.0, kTop = 42.0, kBottom = 52.0,
                 kLegendLine = 18.0;
constexpr double kLegendMark = 24.0, kTickGap = 8.0;
constexpr double kTurn = 6.283185307179586, kQuarter = kTurn / 4;

enum class Anchor { kStart, kMiddle, kEnd };

/// Draws a plot on a surface of its size.
class Painter {
 public:
  Painter(const Plot& plot, const Surface& surface)
      : plot_(plot), cr_(cairo_create(surface.get())), axes_(plot) {}

  void paint() {
    measureLegend();
    color({1, 1, 1});
    cairo_paint(cr_.get());
    drawAxes();
    for (std::size_t i = 0; i < plot_.series.size(); ++i) drawSeries(i);
    drawLegend();
    check(cairo_status(cr_.get()));
  }

 private:
  [[nodiscard]] double right() const { return frameEnd() - rightScale(); }
  /// Where the plot and its scales end and the legend begins.
  [[nodiscard]] double frameEnd() const { return plot_.width - kRight - legendWidth_; }
  [[nodiscard]] double rightScale() const { return plot_.rightTicks.empty() ? 0.0 : kRightScale; }
  [[nodiscard]] double bottom() const { return plot_.height - kBottom; }
  [[nodiscard]] double pixelX(double x) const {
    return kLeft + axes_.x.place(x) * (right() - kLeft);
  }
  [[nodiscard]] double pixelY(double y) const {
    return bottom() - axes_.y.place(y) * (bottom() - kTop);
  }

  void color(const Rgb& c) { cairo_set_source_rgb(cr_.get(), c.r, c.g, c.b); }
  [[nodiscard]] static const Rgb& colorOf(std::size_t series) {
    return kPalette[series % kPalette.size()];
  }

  [[nodiscard]] static double widthOf(const Series& series) {
    return series.emphasis == Emphasis::kOurs ? kThickLine : kLine;
  }

  void line(double x0, double y0, double x1, double y1, double width) {
    cairo_set_line_width(cr_.get(), width);
    cairo_move_to(cr_.get(), x0, y0);
    cairo_line_to(cr_.get(), x1, y1);
    cairo_stroke(cr_.get());
  }

  /// The extents of a text; this also sets the font.
  double widthOf(const std::string& shown, double size) {
    cairo_select_font_face(cr_.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cr_.get(), size);
    cairo_text_extents_t extents;
    cairo_text_extents(cr_.get(), shown.c_str(), &extents);
    return extents.x_advance;
  }

  void text(const std::string& given, double x, double y, Anchor anchor, double size = kTextSize) {
    const std::string shown = shownText(given, LineEnds::kKeep);
    const double width = widthOf(shown, size);
    const double shift = anchor == Anchor::kStart    ? 0.0
                         : anchor == Anchor::kMiddle ? width / 2
                                                     : width;
    cairo_move_to(cr_.get(), x - shift, y);
    cairo_show_text(cr_.get(), shown.c_str());
  }

  void drawAxes() {
    for (const Tick& tick : axes_.x.ticks()) {
      color(kGrid);
      line(pixelX(tick.value), kTop, pixelX(tick.value), bottom(), kHair);
      color(kInk);
      text(labelOf(tick, plot_.textX), pixelX(tick.value), bottom() + kTextSize + kTickGap / 2,
           Anchor::kMiddle);
    }
    for (const Tick& tick : axes_.y.ticks()) {
      color(kGrid);
      line(kLeft, pixelY(tick.value), right(), pixelY(tick.value), kHair);
      color(kInk);
      text(labelOf(tick, plot_.textY), kLeft - kTickGap, pixelY(tick.value) + kTextSize / 3,
           Anchor::kEnd);
    }
    line(kLeft, bottom(), right(), bottom(), kHair);
    line(kLeft, kTop, kLeft, bottom(), kHair);
    drawRightScale();
    drawTitles();
  }

  void drawRightScale() {
    if (plot_.rightTicks.empty()) return;
    color(kInk);
    line(right(), bottom(), right(), kTop, kHair);
    for (const Tick& tick : plot_.rightTicks) {
      if (!axes_.y.holds(tick.value)) continue;
      const double y = pixelY(tick.value);
      line(right(), y, right() + kTickGap / 2, y, kHair);
      text(tick.label, right() + kTickGap, y + kTextSize / 3, Anchor::kStart);
    }
    textUpwards(plot_.rightLabel, frameEnd() - kTickGap / 2);
  }

  void drawTitles() {
    text(plot_.title, plot_.width / 2.0, kTop / 2 + kTitleSize / 3, Anchor::kMiddle, kTitleSize);
    text(plot_.xLabel, (kLeft + right()) / 2, plot_.height - kTextSize, Anchor::kMiddle);
    textUpwards(plot_.yLabel, kTextSize + kTickGap);
  }

  void textUpwards(const std::string& shown, double x) {
    cairo_save(cr_.get());
    cairo_translate(cr_.get(), x, (kTop + bottom()) / 2);
    cairo_rotate(cr_.get(), -kQuarter);
    text(shown, 0.0, 0.0, Anchor::kMiddle);
    cairo_restore(cr_.get());
  }

  void marker(double x, double y) {
    cairo_arc(cr_.get(), x, y, kMarker, 0.0, kTurn);
    cairo_fill(cr_.get());
  }

  void drawSeries(std::size_t i) {
    constexpr std::size_t kMaxMarkers = 40;  // more markers would hide the line
    const auto& points = plot_.series[i].points;
    color(colorOf(i));
    cairo_set_line_width(cr_.get(), widthOf(plot_.series[i]));
    cairo_new_path(cr_.get());  // a text sets the current point to its end
    for (const Point& point : points)
      if (plot_.series[i].joined && axes_.hold(point))
        cairo_line_to(cr_.get(), pixelX(point.x), pixelY(point.y));
    cairo_stroke(cr_.get());
    if (points.size() > kMaxMarkers) return;
    for (const Point& point : points)
      if (axes_.hold(point)) marker(pixelX(point.x), pixelY(point.y));
  }

  /// Draws the legend beside the curves.
  void measureLegend() {
    for (const auto& series : plot_.series)
      legendWidth_ =
          std::max(legendWidth_, widthOf(shownText(series.name, LineEnds::kKeep), kTextSize) +
                                     kLegendMark + 2 * kTickGap);
  }

  void drawLegend() {
    double y = kTop + kLegendLine;
    for (std::size_t i = 0; i < plot_.series.size(); ++i, y += kLegendLine) {
      const double begin = frameEnd() + kTickGap;
      color(colorOf(i));
      line(begin, y - kTextSize / 3, begin + kLegendMark, y - kTextSize / 3,
           widthOf(plot_.series[i]));
      color(kInk);
      text(plot_.series[i].name, begin + kLegendMark + kTickGap, y, Anchor::kStart);
    }
  }

  const Plot& plot_;
  Context cr_;
  PlotAxes axes_;
  double legendWidth_ = 0.0;
};

std::vector<double> valuesOf(const Plot& plot, double Point::*coordinate) {
  std::vector<double> values;
  for (const auto& series : plot.series)
    for (const auto& point : series.points) values.push_back(point.*coordinate);
  return values;
}

}  // namespace

PlotAxes::PlotAxes(const Plot& plot)
    : x(valuesOf(plot, &Point::x), plot.logarithmicX),
      y(valuesOf(plot, &Point::y), plot.logarithmicY) {}

std::string labelOf(const Tick& tick, std::string (*textOf)(double)) {
  return textOf ? textOf(tick.value) : tick.label;
}

std::string toSvg(const Plot& plot) {
  std::string bytes;
  {
    const Surface surface(
        cairo_svg_surface_create_for_stream(appendBytes, &bytes, plot.width, plot.height));
    check(cairo_surface_status(surface.get()));
    Painter(plot, surface).paint();
    cairo_surface_finish(surface.get());
    check(cairo_surface_status(surface.get()));
  }
  return bytes;
}

std::string toPng(const Plot& plot) {
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, plot.width, plot.height));
  check(cairo_surface_status(surface.get()));
  Painter(plot, surface).paint();
  cairo_surface_flush(surface.get());
  return pngBytes(surface);
}

}  // namespace esvr::report
