#pragma once
/// The stiff and extreme cases of docs/figures/stability.md.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/volume.h"
#include "fit/gradient_scene.h"

namespace esvr::bench {

/// A fit of a volume.
struct FitCase {
  std::function<SparseVolume()> volume;
  std::size_t count = 0;           ///< ellipsoids
  std::optional<float> kappa{};    ///< of the kernel; nothing: it is fitted
  std::function<Field()> start{};  ///< ellipsoids to begin with; empty: seeds
  std::uint64_t chunkVoxels = 0;   ///< active voxels of a chunk; 0: one chunk
};

struct StabilityCase {
  std::string name;                               ///< of the row
  std::string detail;                             ///< what is measured, as sentences
  std::function<Field()> field{};                 ///< is evaluated; empty: not measured
  std::optional<test::GradientCase> gradients{};  ///< nothing: not measured
  std::optional<FitCase> fit{};                   ///< nothing: not measured
  /// Further ellipsoids at the same voxels, in the measurement of gradients.
  std::size_t crowd = 0;
};

[[nodiscard]] std::vector<StabilityCase> stabilityCases();

}  // namespace esvr::bench
