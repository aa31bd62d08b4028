#include "render/shading.h"

#include <cmath>
#include <string>

#include "esvr/error.h"
#include "render/value_extent.h"

namespace esvr {
namespace {

/// The direction to a light above the left shoulder of someone at the camera's place.
Vec3 overTheShoulder(const View& view) {
  return view.inCameraSpace(
      difference(sum(scaled(view.up, 0.6), scaled(view.right, -0.5)), view.forward));
}

/// The gradient that has half of its effect, as a share of the transfer function's range for each
/// voxel. The noise of a CT scan is weaker, and surfaces are stronger.
constexpr double kWeakShare = 0.02;

double weakGradient(const TransferFunction& transfer) {
  const ValueExtent extent = extentOf(transfer);
  return kWeakShare * (extent.high - extent.low);
}

float checkedFactor(double factor, const char* name) {
  if (!(factor >= 0.0) || !std::isfinite(factor))
    throw UsageError(std::string("the ") + name + " of the light must not be negative, but is " +
                     std::to_string(factor));
  return float(factor);
}

}  // namespace

LightRule lightRule(const Shading& s, const View& view, const TransferFunction& transfer) {
  const Vec3 light = s.light.value_or(overTheShoulder(view));
  const double l = length(light);
  if (!(l > 0.0) || !std::isfinite(l))
    throw UsageError("the direction to the light must have a length");
  LightRule rule{
      floatPlace(scaled(light, 1.0 / l)),       checkedFactor(s.ambient, "ambient part"),
      checkedFactor(s.diffuse, "diffuse part"), checkedFactor(s.specular, "specular part"),
      checkedFactor(s.shininess, "shininess"),  float(std::pow(weakGradient(transfer), 2.0))};
  if (view.isCube) return rule;
  // A gradient's product with an edge of a voxel is the change of the value along this edge, in the
  // index space and in the camera's space.
  const auto& [a, b, c] = view.voxel.edges;
  const double perVolume = 1.0 / inner(cross(a, b), c);
  const Vec3 ofA = scaled(cross(b, c), perVolume), ofB = scaled(cross(c, a), perVolume),
             ofC = scaled(cross(a, b), perVolume);
  rule.converts = true;
  for (std::size_t axis = 0; axis < 3; ++axis)
    rule.toCamera[axis] = floatPlace({ofA[axis], ofB[axis], ofC[axis]});
  return rule;
}

}  // namespace esvr
