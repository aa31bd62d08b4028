// Pictures as PNG, and color bars, which cairo draws.
#include "programs/pictures.h"

#include <cairo.h>

#include <cstdio>
#include <cstring>
#include <memory>

#include "esvr/error.h"
#include "esvr/grid.h"
#include "programs/run_main.h"

namespace esvr::report {
namespace {

// Cairo's objects with ownership and error checks.

struct FreeSurface {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using Surface = std::unique_ptr<cairo_surface_t, FreeSurface>;

struct FreeContext {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Context = std::unique_ptr<cairo_t, FreeContext>;

/// The text of a failure is cairo's.
void check(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw RuntimeFailure(std::string("cairo: ") + cairo_status_to_string(status));
}

/// A color in cairo's RGB24, with blue in the lowest byte of a word.
std::uint32_t pixelOf(const float* rgba) {
  std::uint32_t pixel = 0;
  for (int c = 0; c < 3; ++c) pixel = pixel << 8 | levelOf(rgba[c]);
  return pixel;
}

}  // namespace

std::string toPng(const Image& image) {
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, image.width, image.height));
  check(cairo_surface_status(surface.get()));
  unsigned char* data = cairo_image_surface_get_data(surface.get());
  const auto stride = std::size_t(cairo_image_surface_get_stride(surface.get()));
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const std::uint32_t pixel = pixelOf(&image.rgba[(std::size_t(y) * image.width + x) * 4]);
      std::memcpy(data + std::size_t(y) * stride + std::size_t(x) * sizeof pixel, &pixel,
                  sizeof pixel);
    }
  cairo_surface_mark_dirty(surface.get());
  std::string bytes;
  const auto append = [](void* to, const unsigned char* part, unsigned int length) {
    static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(part), length);
    return CAIRO_STATUS_SUCCESS;
  };
  check(cairo_surface_write_to_png_stream(surface.get(), append, &bytes));
  return bytes;
}

// Color bars.

namespace {

constexpr double kTextShare = 1.0 / 38.0;  // height of the text, relative to the picture's height
constexpr double kBarShare = 0.56;         // height of the bar, relative to the picture's height
constexpr double kLegible = 5.0;           // pixels; smaller texts are left out

// Lengths in heights of the text.
constexpr double kPanelMargin = 0.8, kPanelPadding = 0.8, kGap = 0.35, kTickLength = 0.35;
constexpr double kColors = 1.1, kOpacities = 0.7, kSquare = kOpacities / 2.0, kLineHeight = 1.35;
constexpr double kTickDistance = 2.6, kMaxName = 9.0, kHairline = 0.07, kRounded = 0.4;

using Color = std::array<double, 3>;
constexpr Color kDarkInk{0.12, 0.12, 0.12}, kLightInk{0.92, 0.92, 0.92};
constexpr double kPanelOpacity = 0.8;
constexpr std::array<double, 2> kChecker{0.92, 0.55};  // grays of the checkerboard

/// The color of texts that can be read in front of a background.
const Color& inkOn(const Color& background) {
  constexpr Color kWeights{0.299, 0.587, 0.114};  // luma of ITU-R BT.601
  double luma = 0.0;
  for (std::size_t i = 0; i < kWeights.size(); ++i) luma += kWeights[i] * background[i];
  return luma < 0.5 ? kLightInk : kDarkInk;
}

constexpr double kRounding = 1e-6;  // relative error of ends, which may be rounded to float32
constexpr double kPlainFrom = 1e-3, kPlainTo = 1e6;  // numbers that need no exponent

std::string tickText(double value) {
  const double size = std::abs(value);
  const bool plain = size == 0.0 || (size >= kPlainFrom && size < kPlainTo);
  return cli::formatted(plain ? "%.6g" : "%.0e", value);
}

int powerOf(double value) { return int(std::floor(std::log10(value) + kRounding)); }

/// The labels of multiples of a step.
class StepLabels {
 public:
  /// \param largest  size of the largest value
  StepLabels(double step, double largest)
      : plain_(step >= kPlainFrom && largest < kPlainTo),
        digits_(plain_ ? std::max(0, -powerOf(step))
                       : std::max(0, powerOf(largest) - powerOf(step))) {}

  [[nodiscard]] std::string of(double value) const {
    if (value == 0.0) return "0";
    std::array<char, 64> text;
    std::snprintf(text.data(), text.size(), plain_ ? "%.*f" : "%.*e", digits_, value);
    return text.data();
  }

 private:
  bool plain_;
  int digits_;
};

/// The smallest number of the form 1, 2 or 5 times a power of ten that is not below a number, up to
/// rounding.
double roundUp(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double digit : {1.0, 2.0, 5.0})
    if (digit * power >= value * (1.0 - kRounding)) return digit * power;
  return 10.0 * power;
}

}  // namespace

std::vector<Tick> roundTicks(double low, double high, double intervals) {
  constexpr double kNarrowest = 1e-12;  // smallest range, relative to its values
  const double range = high - low, largest = std::max(std::abs(low), std::abs(high));
  if (!(range > kNarrowest * largest) || !std::isfinite(range)) return {{low, tickText(low)}};
  const double room = kRounding * range, step = roundUp(range / intervals);
  const double first = std::ceil((low - room) / step);
  const StepLabels labels(step, largest);
  std::vector<Tick> ticks;
  for (double i = 0.0; i <= intervals && (first + i) * step <= high + room; ++i) {
    const double value = (first + i) * step + 0.0;  // the sum turns -0 into 0
    ticks.push_back({value, labels.of(value)});
  }
  return ticks;
}

namespace {

/// Measures and shows texts of one size.
class Lettering {
 public:
  Lettering(cairo_t* cr, double size) : cr_(cr), size_(size) {
    cairo_font_options_t* options = cairo_font_options_create();
    // Hinted letters would have other proportions at each size.
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
    cairo_set_font_options(cr, options);
    cairo_font_options_destroy(options);
  }

  [[nodiscard]] double width(const std::string& text, cairo_font_weight_t weight) const {
    return extents(text, weight).x_advance;
  }
  /// Height of a digit above its base line.
  [[nodiscard]] double digitHeight() const { return extents("0", CAIRO_FONT_WEIGHT_NORMAL).height; }
  void show(const std::string& text, cairo_font_weight_t weight, double x, double y) const {
    (void)extents(text, weight);  // sets the font
    cairo_move_to(cr_, x, y);
    cairo_show_text(cr_, text.c_str());
    cairo_new_path(cr_);
  }

 private:
  cairo_text_extents_t extents(const std::string& text, cairo_font_weight_t weight) const {
    cairo_select_font_face(cr_, "sans-serif", CAIRO_FONT_SLANT_NORMAL, weight);
    cairo_set_font_size(cr_, size_);
    cairo_text_extents_t extents;
    cairo_text_extents(cr_, text.c_str(), &extents);
    return extents;
  }

  cairo_t* cr_;
  double size_;
};

/// Removes the last character of a UTF-8 text.
void dropLast(std::string& text) {
  while (!text.empty() && (std::uint8_t(text.back()) & 0xc0u) == 0x80u) text.pop_back();
  if (!text.empty()) text.pop_back();
}

/// A text of one line that is not wider than `most`; a longer one ends in an ellipsis.
std::string shortened(const std::string& given, double most, cairo_font_weight_t weight,
                      const Lettering& letters) {
  constexpr std::size_t kMostBytes = 200;  // bounds the work for a damaged name
  std::string text = shownText(given.substr(0, kMostBytes), LineEnds::kKeep);
  std::replace(text.begin(), text.end(), '\n', ' ');
  if (letters.width(text, weight) <= most) return text;
  while (!text.empty() && letters.width(text + "\u2026", weight) > most) dropLast(text);
  return text + "\u2026";
}

constexpr auto kBold = CAIRO_FONT_WEIGHT_BOLD, kPlain = CAIRO_FONT_WEIGHT_NORMAL;

/// The texts of a bar and the width of its panel, for texts of one size.
struct Layout {
  Layout(const ColorBar& bar, double textSize, double barHeight, cairo_t* cr) : text(textSize) {
    const Lettering letters(cr, text);
    const double most = kMaxName * text;
    name = shortened(bar.name, most, kBold, letters);
    if (!bar.unit.empty()) unit = shortened("[" + bar.unit + "]", most, kPlain, letters);
    ticks =
        roundTicks(bar.low, bar.high, std::clamp(barHeight / (kTickDistance * text), 2.0, 10.0));
    for (const Tick& tick : ticks) labels = std::max(labels, letters.width(tick.label, kPlain));
    const double heading = std::max(letters.width(name, kBold), letters.width(unit, kPlain));
    panel = std::max(heading, (kColors + kOpacities + kTickLength + kGap) * text + labels) +
            2.0 * kPanelPadding * text;
  }
  /// Width of the panel and the margins beside it.
  [[nodiscard]] double strip() const { return panel + 2.0 * kPanelMargin * text; }
  [[nodiscard]] bool legible() const { return text >= kLegible; }

  double text;  ///< height of the text in pixels
  std::string name, unit;
  std::vector<Tick> ticks;
  double labels = 0.0, panel = 0.0;  ///< widths
};

/// A layout that fits into a picture. All its lengths are proportional to the height of the text.
Layout fittingLayout(const ColorBar& bar, int width, int height, cairo_t* cr) {
  const double barHeight = kBarShare * height, most = kMaxBarShare * width;
  const Layout usual(bar, kTextShare * height, barHeight, cr);
  if (usual.strip() <= most) return usual;
  Layout smaller(bar, usual.text * most / usual.strip(), barHeight, cr);
  // More ticks fit between smaller texts, and their labels may have more digits.
  if (smaller.strip() > most)
    smaller = Layout(bar, smaller.text * most / smaller.strip(), barHeight, cr);
  return smaller;
}

Surface makeSurface(int width, int height) {
  Surface surface(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, width, height));
  check(cairo_surface_status(surface.get()));
  return surface;
}

struct Rectangle {
  double x, y, width, height;
};

/// Draws a color bar on a surface that covers the right edge of the picture.
class BarPainter {
 public:
  BarPainter(const ColorBar& bar, const Layout& layout, const Surface& surface)
      : bar_(bar),
        layout_(layout),
        cr_(cairo_create(surface.get())),
        letters_(cr_.get(), layout.text),
        ink_(inkOn(bar.background)),
        hair_(std::max(1.0, std::round(kHairline * layout.text))) {
    const double height = cairo_image_surface_get_height(surface.get());
    const double text = layout.text, heading = (bar.unit.empty() ? 1.0 : 2.0) * kLineHeight * text;
    panel_ = {cairo_image_surface_get_width(surface.get()) - kPanelMargin * text - layout.panel,
              0.0, layout.panel,
              std::round(kBarShare * height) + heading + (2.0 * kPanelPadding + kGap) * text};
    panel_.y = (height - panel_.height) / 2;
    colors_ = {std::round(panel_.x + kPanelPadding * text),
               std::round(panel_.y + kPanelPadding * text + heading + kGap * text),
               std::round(kColors * text), std::round(kBarShare * height)};
    opacities_ = colors_;
    opacities_.x += colors_.width;
    opacities_.width = 2.0 * squareSide();
  }

  void paint() {
    paintPanel();
    paintChecker();
    for (int row = 0; row < int(colors_.height); ++row) paintRow(row);
    paintFrame();
    if (layout_.legible()) paintTexts();
    check(cairo_status(cr_.get()));
  }

 private:
  void color(const Color& c, double opacity = 1.0) {
    cairo_set_source_rgba(cr_.get(), c[0], c[1], c[2], opacity);
  }
  void fill(const Rectangle& r) {
    cairo_rectangle(cr_.get(), r.x, r.y, r.width, r.height);
    cairo_fill(cr_.get());
  }

  void paintPanel() {
    constexpr double kQuarter = 1.5707963267948966;
    const double r = kRounded * layout_.text;
    const double left = panel_.x + r, right = panel_.x + panel_.width - r;
    const double top = panel_.y + r, bottom = panel_.y + panel_.height - r;
    cairo_arc(cr_.get(), right, top, r, -kQuarter, 0.0);
    cairo_arc(cr_.get(), right, bottom, r, 0.0, kQuarter);
    cairo_arc(cr_.get(), left, bottom, r, kQuarter, 2 * kQuarter);
    cairo_arc(cr_.get(), left, top, r, 2 * kQuarter, 3 * kQuarter);
    cairo_close_path(cr_.get());
    color(bar_.background, kPanelOpacity);
    cairo_fill(cr_.get());
  }

  [[nodiscard]] double squareSide() const {
    return std::max(1.0, std::round(kSquare * layout_.text));
  }
  void paintChecker() {
    const double side = squareSide();
    cairo_save(cr_.get());
    cairo_rectangle(cr_.get(), opacities_.x, opacities_.y, opacities_.width, opacities_.height);
    cairo_clip(cr_.get());
    for (int row = 0; row * side < opacities_.height; ++row)
      for (int column = 0; column * side < opacities_.width; ++column) {
        const double gray = kChecker[std::size_t(row + column) % 2];
        color({gray, gray, gray});
        fill({opacities_.x + column * side, opacities_.y + row * side, side, side});
      }
    cairo_restore(cr_.get());
  }

  /// Draws a line of pixels in both columns. \param row  counted from the top
  void paintRow(int row) {
    if (bar_.shades.empty()) return;
    const double share = 1.0 - (row + 0.5) / colors_.height;
    const auto count = double(bar_.shades.size());
    const Shade& shade = bar_.shades[std::size_t(std::min(share * count, count - 1.0))];
    color(shade.color);
    fill({colors_.x, colors_.y + row, colors_.width, 1.0});
    color(shade.color, shade.opacity);
    fill({opacities_.x, opacities_.y + row, opacities_.width, 1.0});
  }

  void paintFrame() {
    color(ink_);
    cairo_set_line_width(cr_.get(), hair_);
    cairo_rectangle(cr_.get(), colors_.x - hair_ / 2, colors_.y - hair_ / 2,
                    colors_.width + opacities_.width + hair_, colors_.height + hair_);
    cairo_stroke(cr_.get());
  }

  void paintTexts() {
    const double x = panel_.x + kPanelPadding * layout_.text;
    const double y = panel_.y + (kPanelPadding + 0.8) * layout_.text;
    letters_.show(layout_.name, kBold, x, y);
    letters_.show(layout_.unit, kPlain, x, y + kLineHeight * layout_.text);
    for (const Tick& tick : layout_.ticks) paintTick(tick);
  }

  void paintTick(const Tick& tick) {
    const double range = bar_.high - bar_.low;
    const double share = range > 0.0 ? std::clamp((tick.value - bar_.low) / range, 0.0, 1.0) : 0.5;
    const double y = std::round(colors_.y + (1.0 - share) * colors_.height) - hair_ / 2;
    const double x = opacities_.x + opacities_.width + hair_, end = x + kTickLength * layout_.text;
    cairo_move_to(cr_.get(), x, y);
    cairo_line_to(cr_.get(), end, y);
    cairo_stroke(cr_.get());
    letters_.show(tick.label, kPlain, end + kGap * layout_.text, y + letters_.digitHeight() / 2);
  }

  const ColorBar& bar_;
  const Layout& layout_;
  Context cr_;
  Lettering letters_;
  Color ink_;
  double hair_;  ///< width of lines, whole pixels
  Rectangle panel_{}, colors_{}, opacities_{};
};

/// Draws a pixel of cairo's ARGB32, which is premultiplied, in front of four floats.
void drawInFront(std::uint32_t argb, float* rgba) {
  const auto channel = [&](int shift) { return float(argb >> shift & 0xffu) / 255.0f; };
  const float behind = 1.0f - channel(24);
  const std::array front{channel(16), channel(8), channel(0), channel(24)};
  for (std::size_t c = 0; c < front.size(); ++c) rgba[c] = front[c] + behind * rgba[c];
}

/// Draws a surface in front of the right edge of a picture of the same height.
void drawInFront(const Surface& surface, Image& picture) {
  const int width = cairo_image_surface_get_width(surface.get());
  const auto stride = std::size_t(cairo_image_surface_get_stride(surface.get()));
  cairo_surface_flush(surface.get());
  const unsigned char* data = cairo_image_surface_get_data(surface.get());
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < width; ++x) {
      std::uint32_t argb = 0;
      std::memcpy(&argb, data + std::size_t(y) * stride + std::size_t(x) * sizeof argb,
                  sizeof argb);
      const std::size_t column = std::size_t(picture.width - width + x);
      drawInFront(argb, &picture.rgba[4 * (std::size_t(y) * std::size_t(picture.width) + column)]);
    }
}

Layout layoutOf(const ColorBar& bar, int width, int height) {
  const Surface pixel = makeSurface(1, 1);
  const Context cr(cairo_create(pixel.get()));
  Layout layout = fittingLayout(bar, width, height, cr.get());
  check(cairo_status(cr.get()));
  return layout;
}

}  // namespace

double colorBarShare(const ColorBar& bar, int width, int height) {
  return std::min(layoutOf(bar, width, height).strip() / width, kMaxBarShare);
}

void drawColorBar(const ColorBar& bar, Image& picture) {
  const Layout layout = layoutOf(bar, picture.width, picture.height);
  const int width = std::min(int(std::ceil(layout.strip())), picture.width);
  const Surface surface = makeSurface(width, picture.height);
  BarPainter(bar, layout, surface).paint();
  drawInFront(surface, picture);
}

}  // namespace esvr::report
