#pragma once
/// Transfer functions map values to colors and opacities. They are given as points on an axis of
/// values and are interpolated between the points as in ParaView and VTK, so that a preset gives
/// the same colors as in these programs.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esvr/volume.h"

namespace esvr {

struct GridDescriptor;
struct StoredGrid;

/// An sRGB color; each channel is between 0 and 1.
struct Rgb {
  double r = 0.0, g = 0.0, b = 0.0;
  friend bool operator==(const Rgb&, const Rgb&) = default;
};

/// The color space in which colors are interpolated.
enum class ColorSpace {
  kRgb,
  kHsv,        ///< the hue is a number: from 0.9 to 0.1 it passes through 0.5
  kHsvWrap,    ///< the hue is an angle: from 0.9 to 0.1 it passes through 0
  kLab,        ///< CIE L*a*b*, white D65
  kDiverging,  ///< through white between two hues (Moreland, "Diverging color maps", 2009)
  kStep        ///< no interpolation: the upper point's color holds between two points
};

struct ColorPoint {
  double x = 0.0;
  Rgb color;
  friend bool operator==(const ColorPoint&, const ColorPoint&) = default;
};

/// A color map has at least one point, and x does not decrease. Values below the first point have
/// the color of the first point, and values above the last point have the color of the last point.
struct ColorMap {
  ColorSpace space = ColorSpace::kRgb;
  std::vector<ColorPoint> points;
  Rgb nan{0.5, 0.0, 0.0};  ///< color of NaN values
  friend bool operator==(const ColorMap&, const ColorMap&) = default;
};

/// The midpoint and the sharpness determine the curve from a point to the next one, as in
/// vtkPiecewiseFunction. The midpoint is the share of the interval at which half of the change is
/// reached. A sharpness of 0 gives straight lines, and a sharpness of 1 gives a step at the
/// midpoint.
struct OpacityPoint {
  double x = 0.0;
  double opacity = 0.0;  ///< 0 to 1, over a length of RenderOptions::opacityLength voxels
  double midpoint = 0.5;
  double sharpness = 0.0;
  friend bool operator==(const OpacityPoint&, const OpacityPoint&) = default;
};

/// An opacity curve has at least one point, and x does not decrease. It is constant before the
/// first point and behind the last.
using OpacityCurve = std::vector<OpacityPoint>;

struct TransferFunction {
  ColorMap colors;
  OpacityCurve opacity;
  friend bool operator==(const TransferFunction&, const TransferFunction&) = default;
};

/// Validates a transfer function.
/// \throws UsageError  there are no points, or they are not in order or not finite; opacities,
///                     midpoints, sharpnesses or colors are outside 0 to 1
void checkTransferFunction(const TransferFunction& function);

[[nodiscard]] Rgb colorAt(const ColorMap& map, double x);
[[nodiscard]] double opacityAt(const OpacityCurve& curve, double x);

/// Maps the points linearly, so that the first and last color point, and the first and last opacity
/// point, lie at the ends of `range`. If the range or the function has no extent, all points lie at
/// range.min.
[[nodiscard]] TransferFunction rescaled(TransferFunction function, ValueRange range);

/// Names that builtInColorMap takes, in the order of a help text.
[[nodiscard]] std::vector<std::string> builtInColorMaps();
/// A color map over the values 0 to 1.
/// \throws UsageError  the name is unknown; the text lists the known names
[[nodiscard]] ColorMap builtInColorMap(const std::string& name);

/// Names that builtInOpacity takes, in the order of a help text.
[[nodiscard]] std::vector<std::string> builtInOpacities();
/// An opacity curve over the values 0 to 1: "linear" rises, "inverse" falls, "tent" rises to the
/// middle and falls again, "step" is 0 below the middle and 1 above; "smoke", "ct-bone" and
/// "ct-soft-tissue" belong to the color maps of these names.
/// \throws UsageError  the name is unknown
[[nodiscard]] OpacityCurve builtInOpacity(const std::string& name);

/// Shows a level set, whose values are distances from a surface and negative inside, as an opaque
/// body. A thin dark layer before the surface is longer on rays that meet it at a flat angle, so
/// that faces of different directions differ in brightness.
/// \param band  distance from the surface to the end of the narrow band, usually the background
/// \throws UsageError  the band is not positive
[[nodiscard]] TransferFunction levelSetSurface(double band);

/// What the look of a grid follows from where no other look is asked for.
struct LookBasis {
  ValueRange range{};       ///< of the active values
  float background = 0.0f;  ///< the range of the look includes it
  bool isLevelSet = false;
  /// Of a fog volume: the depth of its median column, medianDepth() (metrics.h).
  std::optional<double> medianDepth{};
};

/// The basis of a volume's look. \throws BadInput  a value is not finite
[[nodiscard]] LookBasis lookBasis(const GridDescriptor& grid, const SparseVolume& volume);

/// The basis of a stored grid's look. The median column of a sum of ellipsoids is estimated, which
/// takes no longer for a large grid. Stored voxels are decoded for it.
/// \throws MemoryExceeded  they take more than maxBytes
[[nodiscard]] LookBasis lookBasis(const StoredGrid& grid, std::uint64_t maxBytes);

/// The usual opacity. It rises linearly over the range and is 1 at the largest value. If the largest
/// values of a fog volume are so far above the others that the median column would let more than
/// half of the light through, small values get a higher opacity: that of an extinction in
/// proportion to the value, with which the median column lets half of the light through in rays of
/// one voxel a unit of RenderOptions::opacityLength. No value has a lower opacity than by the line.
[[nodiscard]] OpacityCurve usualOpacity(const LookBasis& grid);

/// The usual look: levelSetSurface() for a level set with a positive background, otherwise a color
/// map and usualOpacity(). esvr-render, esvr-view, the exported page and Python begin with it.
[[nodiscard]] TransferFunction usualLook(const LookBasis& grid,
                                         const std::string& colors = "viridis");

/// Reads a ParaView preset in one of two formats:
///  - JSON: an object, or an array of objects, with "RGBPoints" [x r g b ...] and optionally
///    "Name", "ColorSpace" (RGB, HSV, Lab, CIELAB, Lab/CIEDE2000, Diverging, Step), "HSVWrap", "Points"
///    [x opacity midpoint sharpness ...] and "NanColor" [r g b]. The points may be in any order.
///  - the XML of older versions: <ColorMap name space> with <Point x o r g b> and <NaN r g b>. If
///    all opacities o are 1, the map has colors only, and the opacities are ignored.
/// A preset without opacities gets a linear one over the range of its colors.
/// \param name  name of the preset in the file; empty: the first preset that has colors
/// \throws BadInput  the file is missing, neither JSON nor XML, or has no such preset (the text
///                   lists the presets); the preset is no transfer function (the text says why)
[[nodiscard]] TransferFunction readParaViewPreset(const std::filesystem::path& path,
                                                  const std::string& name = {});

struct NamedTransferFunction {
  std::string name;
  TransferFunction function;
};
/// All presets of a text in one of these formats that have colors.
/// \param source  name of the text for errors
/// \throws BadInput  there is none; as for readParaViewPreset
[[nodiscard]] std::vector<NamedTransferFunction> paraViewPresets(const std::string& text,
                                                                 const std::string& source);

/// The JSON text of a file with one preset. readParaViewPreset and ParaView can read it.
/// \throws UsageError  see checkTransferFunction
[[nodiscard]] std::string paraViewPreset(const TransferFunction& function, const std::string& name);

}  // namespace esvr
