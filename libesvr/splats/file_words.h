#pragma once
/// What writers and readers of files of splats have in common.

namespace esvr::splats {

/// The first spherical harmonic, and the color of a splat whose coefficients are 0.
inline constexpr double kFirstHarmonic = 0.28209479177387814, kMiddleColor = 0.5;

// The first words of the comments in our PLY files. Each has its value behind it.
inline constexpr const char* kMatrixWord = "esvr_to_world";  ///< SplatScene::toWorld, 16 numbers
inline constexpr const char* kUpWord = "esvr_up";            ///< y or z
inline constexpr const char* kDensityWord = "esvr_density_scale";
inline constexpr const char* kGridWord = "esvr_grid";

}  // namespace esvr::splats
