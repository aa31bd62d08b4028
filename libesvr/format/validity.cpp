#include "format/validity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

namespace esvr::format {
namespace {

bool finite(double v) { return std::isfinite(v); }

bool allFinite(std::initializer_list<double> values) {
  return std::all_of(values.begin(), values.end(), finite);
}

bool validKernel(const Kernel& kernel) {
  return finite(kernel.kappa) && kernel.epsilon > 0.0f && kernel.epsilon < 1.0f;
}

bool validAffine(const Transform& transform) {
  return !transform.affine ||
         std::all_of(transform.affine->begin(), transform.affine->end(), finite);
}

std::optional<Fault> nonFinite(SectionKind section, const char* what,
                               std::span<const std::vector<float>> planes) {
  for (const auto& plane : planes) {
    const auto it = std::find_if_not(plane.begin(), plane.end(), finite);
    if (it != plane.end())
      return Fault{section, std::string(what) + " of ellipsoid " +
                                std::to_string(it - plane.begin()) + " is not finite"};
  }
  return std::nullopt;
}

std::optional<Fault> extremeScale(const std::array<std::vector<float>, 3>& logScale) {
  const auto extreme = [](float v) { return std::abs(v) > kMaxLogScale; };
  for (const auto& plane : logScale) {
    const auto it = std::find_if(plane.begin(), plane.end(), extreme);
    if (it != plane.end())
      return Fault{SectionKind::kScales, "a scale of ellipsoid " +
                                             std::to_string(it - plane.begin()) +
                                             " is not between e^-32 and e^32 voxels"};
  }
  return std::nullopt;
}

/// The bytes of OpenVDB's maps, which consist of vectors and of matrices of doubles. A frustum holds
/// another map, so that only its smallest size is known.
struct MapSize {
  std::string_view type;
  std::size_t bytes = 0;
};
constexpr std::size_t kVector = 3 * sizeof(double), kMatrix = 16 * sizeof(double);
constexpr std::array kMapSizes{MapSize{"UniformScaleMap", 5 * kVector},
                               MapSize{"ScaleMap", 5 * kVector},
                               MapSize{"TranslationMap", kVector},
                               MapSize{"UniformScaleTranslateMap", 6 * kVector},
                               MapSize{"ScaleTranslateMap", 6 * kVector},
                               MapSize{"UnitaryMap", kMatrix},
                               MapSize{"AffineMap", kMatrix}};
constexpr MapSize kFrustum{"NonlinearFrustumMap", 3 * kVector + kVector};

}  // namespace

std::optional<Fault> mapFaultOf(const Transform& transform) {
  const std::size_t bytes = transform.map.size();
  const auto known = std::ranges::find(kMapSizes, transform.mapType, &MapSize::type);
  const bool isGood = transform.mapType == kFrustum.type
                          ? bytes > kFrustum.bytes
                          : known == kMapSizes.end() || bytes == known->bytes;
  if (isGood) return std::nullopt;
  return Fault{SectionKind::kGrid, "the transform is damaged: " + std::to_string(bytes) +
                                       " bytes are not a map of type " + transform.mapType};
}

std::optional<Fault> faultOf(const StoredGrid& grid) {
  const auto fault = [](const char* text) { return Fault{SectionKind::kGrid, text}; };
  if (!allFinite({grid.descriptor.background, grid.field.background}))
    return fault("the background is not finite");
  if (!validAffine(grid.descriptor.transform)) return fault("the affine map is not finite");
  if (!validKernel(grid.field.kernel))
    return fault("the kernel's kappa is not finite or its epsilon not between 0 and 1");
  if (grid.farBackground && grid.topology != TopologyKind::kMask &&
      grid.topology != TopologyKind::kThreshold)
    return fault("a far background needs a mask or voxels");
  if (!finite(grid.activeThreshold)) return fault("the threshold is not finite");
  if (grid.topology == TopologyKind::kBlocks && !(grid.activeThreshold > 0.0f))
    return fault("the threshold of blocks is not above 0");
  if (!allFinite({grid.valueMin, grid.valueMax}) || grid.valueMin > grid.valueMax)
    return fault("the range of values is not finite or empty");
  return std::nullopt;
}

std::optional<Fault> residualFaultOf(const StoredGrid& grid) {
  const auto fault = [](const char* text) { return Fault{SectionKind::kResidual, text}; };
  if (!grid.residual) return std::nullopt;
  if (grid.voxels) return fault("a residual to voxels that are stored themselves");
  if (grid.residual->form != VoxelForm::kQuantised)
    return fault("a residual that is not quantised");
  for (const BrickMask& mask : grid.residual->active)
    if (mask.count() != kBrickVoxels) return fault("a residual with voxels that are not active");
  return std::nullopt;
}

std::optional<Fault> faultOf(StoredComponents components) {
  const GridDescriptor& first = components.front().descriptor;
  for (const StoredGrid& component : components) {
    const GridDescriptor& d = component.descriptor;
    if (d.gridClass != first.gridClass || d.valueType != first.valueType ||
        d.transform != first.transform)
      return Fault{SectionKind::kVector, "its components differ in class, value type or transform"};
  }
  return std::nullopt;
}

std::optional<Fault> faultOf(const Ellipsoids& e) {
  if (auto f = nonFinite(SectionKind::kCenters, "the center", e.center)) return f;
  if (auto f = nonFinite(SectionKind::kScales, "a scale", e.logScale)) return f;
  if (auto f = extremeScale(e.logScale)) return f;
  if (auto f = nonFinite(SectionKind::kRotations, "the rotation", e.rotation)) return f;
  if (auto f = nonFinite(SectionKind::kIntensities, "the intensity", {&e.intensity, 1})) return f;
  if (auto f = nonFinite(SectionKind::kKappas, "the kappa", {&e.kappa, 1})) return f;
  if (!wellFormed(e)) return Fault{SectionKind::kRotations, "a quaternion is not of unit length"};
  return std::nullopt;
}

}  // namespace esvr::format
