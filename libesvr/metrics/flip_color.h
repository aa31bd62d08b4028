#pragma once
/// Color spaces of FLIP: sRGB to linear RGB, CIE XYZ, YCxCz (a linear L*a*b*) and L*a*b*, all under
/// D65.

#include <array>

namespace esvr::metrics {

using Color = std::array<double, 3>;

/// Linear RGB from what a screen takes (IEC 61966-2-1).
[[nodiscard]] Color linearFromSrgb(const Color& srgb);

/// Opponent colors, linear in the light: what the eye's spatial filters act on.
[[nodiscard]] Color ycxczFromLinear(const Color& linear);
[[nodiscard]] Color linearFromYcxcz(const Color& ycxcz);

/// L*a*b* with chroma that fades in the dark (Hunt): a and b times L / 100.
[[nodiscard]] Color huntLabFromLinear(const Color& linear);

/// |L difference| + length of the chroma's difference (Abasi et al. 2020).
[[nodiscard]] double hyab(const Color& a, const Color& b);

}  // namespace esvr::metrics
