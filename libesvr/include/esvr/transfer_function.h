#pragma once
/// From values to colors and opacities. A transfer function is points along an axis of values; what
/// lies between them is interpolated as ParaView and VTK do, so that a preset looks the same here.

#include <filesystem>
#include <string>
#include <vector>

#include "esvr/sparse_volume.h"

namespace esvr {

/// Red, green, blue as a screen takes them (sRGB), 0 to 1.
struct Rgb {
  double r = 0.0, g = 0.0, b = 0.0;
  friend bool operator==(const Rgb&, const Rgb&) = default;
};

/// In which space colors are mixed.
enum class ColorSpace {
  kRgb,
  kHsv,        ///< hue as a number: from 0.9 to 0.1 it passes 0.5
  kHsvWrap,    ///< hue as an angle: from 0.9 to 0.1 it passes 0
  kLab,        ///< CIE L*a*b*, white D65
  kDiverging,  ///< through white between two hues (Moreland, "Diverging color maps", 2009)
  kStep        ///< not at all: between two points the color of the upper one
};

struct ColorPoint {
  double x = 0.0;
  Rgb color;
  friend bool operator==(const ColorPoint&, const ColorPoint&) = default;
};

/// At least one point, x not decreasing; before the first and behind the last, their colors.
struct ColorMap {
  ColorSpace space = ColorSpace::kRgb;
  std::vector<ColorPoint> points;
  Rgb nan{0.5, 0.0, 0.0};  ///< color of values that are not a number
  friend bool operator==(const ColorMap&, const ColorMap&) = default;
};

/// The curve from a point to the next one is bent by the point's midpoint (where, of the way, it
/// has half of the change) and sharpness (0: straight lines, 1: a step at the midpoint), as in
/// vtkPiecewiseFunction.
struct OpacityPoint {
  double x = 0.0;
  double opacity = 0.0;  ///< 0 to 1, over the length that RenderOptions::opacityLength says
  double midpoint = 0.5;
  double sharpness = 0.0;
  friend bool operator==(const OpacityPoint&, const OpacityPoint&) = default;
};

/// At least one point, x not decreasing; before the first and behind the last, their opacities.
using OpacityCurve = std::vector<OpacityPoint>;

struct TransferFunction {
  ColorMap colors;
  OpacityCurve opacity;
  friend bool operator==(const TransferFunction&, const TransferFunction&) = default;
};

/// \throws UsageError  no points, or not in order, or not finite; opacities, midpoints or
///                     sharpnesses outside 0 to 1; colors outside 0 to 1
void checkTransferFunction(const TransferFunction& function);

[[nodiscard]] Rgb colorAt(const ColorMap& map, double x);
[[nodiscard]] double opacityAt(const OpacityCurve& curve, double x);

/// The points moved so that the first and last of the colors, and those of the opacities, lie at
/// the ends of `range`. A range or function without extent has all points at range.min.
[[nodiscard]] TransferFunction rescaled(TransferFunction function, ValueRange range);

/// Names for builtInColorMap, in the order of a help text.
[[nodiscard]] std::vector<std::string> builtInColorMaps();
/// A color map from 0 to 1. \throws UsageError  no such map; lists those there are
[[nodiscard]] ColorMap builtInColorMap(const std::string& name);

[[nodiscard]] std::vector<std::string> builtInOpacities();
/// A curve from 0 to 1: "linear" rises, "inverse" falls, "tent" rises to the middle and falls,
/// "step" is 0 below the middle and 1 above; "smoke", "ct-bone" and "ct-soft-tissue" go with the
/// color maps of these names. \throws UsageError  no such curve
[[nodiscard]] OpacityCurve builtInOpacity(const std::string& name);

/// Reads a ParaView preset: a JSON array of objects, or one object, with "RGBPoints" [x r g b ...],
/// and optionally "Name", "ColorSpace" (RGB, HSV, Lab, CIELAB, Diverging, Step), "HSVWrap",
/// "Points" [x opacity midpoint sharpness ...] and "NanColor" [r g b]. Points need no order.
/// Without "Points" the opacity is linear over the range of the colors. Older ParaView's XML, too:
/// <ColorMap name space> with <Point x o r g b> and <NaN r g b>; opacities o that are all 1 are
/// those of a map of colors only, and count as none.
/// \param name  of the preset in the file; empty for the first that has colors
/// \throws BadInput  missing, not JSON, not XML, no such preset (lists those there are), not a
///                   transfer function (says why)
[[nodiscard]] TransferFunction readParaViewPreset(const std::filesystem::path& path,
                                                  const std::string& name = {});

/// The JSON text of a file with one preset, which readParaViewPreset and ParaView read.
/// \throws UsageError  as checkTransferFunction
[[nodiscard]] std::string paraViewPreset(const TransferFunction& function, const std::string& name);

}  // namespace esvr
