#pragma once
/// The five synthetic volumes on which the paper compares kinds of ellipsoids (appendix, 'Ellipsoid
/// Type Comparison'). The paper shows slices and gives no formulas; these volumes are similar.
/// And the samples by name: generated volumes with their grids and metadata.

#include <span>
#include <string>
#include <vector>

#include "esvr/grid.h"
#include "esvr/vdb_io.h"
#include "esvr/volume.h"
#include "generators/voxelise.h"

namespace esvr::samples {

/// 8area: a dense volume in eight chunks of different density, each varying smoothly.
[[nodiscard]] SparseVolume makeEightAreas(const SampleOptions& options);

/// EmptySphere: a thin shell.
[[nodiscard]] SparseVolume makeEmptySphere(const SampleOptions& options);

/// SynthTube: straight tubes of different thickness.
[[nodiscard]] SparseVolume makeSynthTube(const SampleOptions& options);

/// SynthWiggle: thin tubes that wind around their axes.
[[nodiscard]] SparseVolume makeSynthWiggle(const SampleOptions& options);

/// DiffuseScalar: a ball that fades out over most of its radius.
[[nodiscard]] SparseVolume makeDiffuseScalar(const SampleOptions& options);

// ---- Kinds of samples

inline constexpr double kWorldSize = 10.0;  ///< a sample's longest side in world units

struct SampleFile {
  std::vector<MetaItem> metadata;
  std::vector<VolumeGrid> grids;
};

struct SampleKind {
  const char* name;
  const char* description;  ///< one line, for --help
  SampleFile (*make)(const SampleOptions& options);
  bool moves = false;  ///< it has more frames than one (SampleOptions::frame)
};

/// All kinds, in the order of --help.
[[nodiscard]] std::span<const SampleKind> sampleKinds();

/// \throws UsageError  the name is unknown; the text lists the known names
[[nodiscard]] const SampleKind& sampleKind(const std::string& name);

/// Makes a fog volume of float values.
[[nodiscard]] VolumeGrid densityGrid(SparseVolume volume, const Transform& transform,
                                     const std::string& name = "density");

}  // namespace esvr::samples
