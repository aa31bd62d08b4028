#include "render/look_text.h"

#include <vector>

#include "cli/number_list.h"
#include "esvr/error.h"

namespace esvr::render {
namespace {

std::optional<TransferFunction> transferOf(const LookText& text, const std::string& usualColors) {
  if (!text.tf && text.preset) throw UsageError("--preset says nothing without --tf");
  if (!text.tf && !text.opacity && !text.colors) return std::nullopt;
  if (!text.tf)
    return TransferFunction{builtInColorMap(text.colors.value_or(usualColors)),
                            builtInOpacity(text.opacity.value_or(kUsualOpacity))};
  if (text.colors) throw UsageError("--tf and --colors are two color maps; give one");
  auto f = readParaViewPreset(*text.tf, text.preset.value_or(""));
  if (!text.opacity) return f;
  const auto& points = f.colors.points;
  f.opacity = builtInOpacity(*text.opacity);
  for (auto& p : f.opacity) p.x = points.front().x + p.x * (points.back().x - points.front().x);
  return f;
}

void readRange(const std::string& text, Look& look) {
  if (text == "auto")
    look.rangeKind = RangeKind::kAuto;
  else if (text == "data")
    look.rangeKind = RangeKind::kData;
  else if (text == "own")
    look.rangeKind = RangeKind::kOwn;
  else {
    const auto v = cli::parseNumbers("range", text, 2);
    if (v[0] > v[1]) throw UsageError("--range must have LO <= HI, not '" + text + "'");
    look.rangeKind = RangeKind::kGiven;
    look.range = {float(v[0]), float(v[1])};
  }
}

std::vector<std::string> partsOf(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ':')
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

/// Reads one part of --with after the name.
void readPart(const std::string& part, LookText& text, FurtherGrid& grid) {
  const auto equals = part.find('=');
  const std::string key = part.substr(0, equals);
  const std::string value = equals == std::string::npos ? "" : part.substr(equals + 1);
  if (key == "emission" && equals == std::string::npos)
    grid.absorbs = false;
  else if (key == "colors" && !value.empty())
    text.colors = value;
  else if (key == "opacity" && !value.empty())
    text.opacity = value;
  else if (key == "tf" && !value.empty())
    text.tf = value;
  else if (key == "preset" && !value.empty())
    text.preset = value;
  else if (key == "range" && !value.empty())
    text.range = value;
  else
    throw UsageError("'" + part +
                     "' must be emission, or one of colors, opacity, tf, preset and range with '=' "
                     "and a value");
}

}  // namespace

Look lookOf(const LookText& text, const std::string& usualColors) {
  Look look;
  look.transfer = transferOf(text, usualColors);
  readRange(text.range, look);
  return look;
}

FurtherGrid furtherGridOf(const std::string& text) {
  const auto parts = partsOf(text);
  FurtherGrid grid{parts.front(), {}};
  if (grid.name.empty()) throw UsageError("--with must begin with the name of a grid");
  LookText look;
  try {
    for (std::size_t i = 1; i < parts.size(); ++i) readPart(parts[i], look, grid);
    grid.look = lookOf(look, kUsualFurtherColors);
  } catch (const UsageError& error) {
    throw UsageError("--with " + text + ": " + error.what());
  }
  return grid;
}

}  // namespace esvr::render
