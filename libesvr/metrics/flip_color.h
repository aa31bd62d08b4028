#pragma once
/// Color spaces of FLIP: sRGB to linear RGB, CIE XYZ, YCxCz (a linear L*a*b*) and L*a*b*, all under
/// D65.

#include <array>

namespace esvr::metrics {

using Color = std::array<double, 3>;

/// Converts sRGB to linear RGB (IEC 61966-2-1).
[[nodiscard]] Color linearFromSrgb(const Color& srgb);

/// Converts to opponent colors (YCxCz), which are linear in light and which the filters act on.
[[nodiscard]] Color ycxczFromLinear(const Color& linear);
[[nodiscard]] Color linearFromYcxcz(const Color& ycxcz);

/// L*a*b* with the Hunt effect: a and b are multiplied by L / 100.
[[nodiscard]] Color huntLabFromLinear(const Color& linear);

/// The distance |difference of L| + length of the difference of chroma (Abasi et al. 2020).
[[nodiscard]] double hyab(const Color& a, const Color& b);

}  // namespace esvr::metrics
